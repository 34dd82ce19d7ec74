"""MuJoCo's MJCF: the frames of the calibrated joints, and masses.

Bodies are nested, each at its joint's frame: position and quaternion in the body before, the
joint's axis, its range. The base is the first body, flange and tool are sites of the last. Inertia is that of
spheres, as a calibration knows masses and centres alone.

Sources: MuJoCo's XML reference (body, joint, compiler).
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from typing import final

import numpy as np

from workbench.arm import chain as chains
from workbench.arm.joint_frames import JointFrames
from workbench.arm.masses import carried, sphere_inertia
from workbench.arm.robot import JointKind, Robot
from workbench.arm.urdf_writer import numbers_text as _text
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4
from workbench.exports.export_format import AbstractForm, Job

MIN_MASS, MIN_INERTIA = "0.001", "1e-06"


@final
class Mjcf(AbstractForm):
    """A model for MuJoCo, of frames, joints and masses."""

    name = "mjcf"
    title = "MuJoCo model (MJCF) with the calibrated joints' frames"
    ending = ".xml"

    def write(self, job: Job) -> str:
        robot, frames = job.robot, job.frames
        if job.source is not None:
            raise OptionError("--for mjcf writes a new model; --into FILE is for --for urdf", option="--into")
        root = ET.Element("mujoco", model=robot.name)
        ET.SubElement(root, "compiler", angle="radian", boundmass=MIN_MASS, boundinertia=MIN_INERTIA)
        ET.SubElement(root, "option", gravity=_text(robot.gravity))
        node = _body(ET.SubElement(root, "worldbody"), "base", robot.base.pose)
        parts = zip(robot.joint_names, frames.joints, _masses(robot, frames), strict=True)
        for name, joint, mass in parts:
            node = _body(node, f"{name}_link", joint.before @ joint.origin)
            kind = "slide" if joint.joint.kind is JointKind.PRISMATIC else "hinge"
            entry = ET.SubElement(node, "joint", name=name, type=kind, axis=_text(joint.axis))
            if np.isfinite(joint.joint.limits).all():
                entry.attrib.update(limited="true", range=_text(np.array(joint.joint.limits)))
            if mass is not None:
                own = _text(np.full(3, sphere_inertia(mass[0])))
                ET.SubElement(node, "inertial", pos=_text(mass[1]), mass=repr(mass[0]), diaginertia=own)
        _body(node, "flange", frames.flange, kind="site")
        _body(node, "tool", frames.flange @ robot.tool.pose, kind="site")
        ET.indent(root)
        return ET.tostring(root, encoding="unicode") + "\n"

    def read(self, text: str, job: Job) -> Robot:
        root, frames = ET.fromstring(text), job.frames
        poses, (flange, _) = ([_pose(node) for node in root.iter(kind)] for kind in ("body", "site"))
        own = zip(frames.joints, poses[1:], strict=True)
        return frames.with_origins([se3.inverse(j.before) @ p for j, p in own], flange).robot(job.robot)

    def notes(self, job: Job) -> Iterable[str]:
        if not job.robot.has_masses:
            yield "masses are unknown: links have MuJoCo's minimum mass, enough for kinematics only"


def _masses(robot: Robot, frames: JointFrames) -> list[tuple[float, np.ndarray] | None]:
    """Mass and its centre in each joint's frame; None where the mass is unknown."""
    after = np.array([i for i, e in enumerate(robot.elements) if e.joint is not None])
    still = chains.Chain(tuple(robot.elements), robot.dof)
    places = chains.frames(still, np.zeros((1, robot.dof)), after)[0]
    return [
        None if mass is None else (float(mass), se3.apply(se3.inverse(own) @ place, com))
        for (mass, com), own, place in zip(carried(robot), frames.at_zero, places, strict=False)
    ]


def _body(parent: ET.Element, name: str, pose: Matrix4, *, kind: str = "body") -> ET.Element:
    quat = se3.matrix_to_quaternion(pose[:3, :3])
    return ET.SubElement(parent, kind, name=name, pos=_text(pose[:3, 3]), quat=_text(quat))


def _pose(node: ET.Element) -> Matrix4:
    pos, quat = (np.array([float(v) for v in node.get(key, "").split()]) for key in ("pos", "quat"))
    return se3.pose(se3.quaternion_to_matrix(quat), pos)
