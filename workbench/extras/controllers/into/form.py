"""`export --for urdf|xacro|sdf|mjcf --into FILE`."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import final

import numpy as np

from workbench.arm.joint_frames import JointFrame, JointFrames, joint_frames
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, frozen
from workbench.exports.export_format import AbstractForm, Job
from workbench.extras.controllers.into.formats import mjcf_model, sdf_model, urdf_model
from workbench.extras.controllers.into.model import Model
from workbench.extras.controllers.into.placing import Placing, place
from workbench.extras.controllers.into.xml_bytes import edited
from workbench.extras.controllers.joint_names import joint_names


@final
@dataclass(frozen=True)
class IntoForm(AbstractForm):
    """A model file that gets other numbers."""

    name: str = ""
    title: str = ""
    ending: str = ""  # type: ignore[misc]
    parse: Callable[[str], Model] = urdf_model

    def write(self, job: Job) -> str:
        placing = _placing(self, job)
        return edited(job.source or "", placing.edits)

    def read(self, text: str, job: Job) -> Robot:
        placing, model = _placing(self, job), self.parse(text)
        frames, root = job.frames, se3.inverse(placing.base)
        pairs = [(root @ model.at_zero(e.frame), e.axis()) for e in placing.chain]
        at = [pose @ se3.pose(np.eye(3), point) for pose, (point, _) in pairs]
        flange = frames.at_zero[-1]
        if ends := placing.ends:
            nominal = placing.base @ joint_frames(job.require_before(self.name)).at_zero[-1]
            flange = root @ model.at_zero(ends[0]) @ se3.inverse(placing.model.at_zero(ends[0])) @ nominal
        steps = [se3.inverse(a) @ b for a, b in pairwise([np.eye(4), *at, flange])]
        joints = [
            JointFrame(own.joint, frozen(step), frozen(axis / np.linalg.norm(axis)))
            for own, step, (_, (_, axis)) in zip(frames.joints, steps, pairs, strict=False)
        ]
        return JointFrames(tuple(joints), frozen(steps[-1])).robot(job.robot)

    def notes(self, job: Job) -> Iterable[str]:
        placing = _placing(self, job)
        names = [e.name for e in placing.chain]
        if not placing.by_name:
            yield f"joints matched by their order, as their names differ: {', '.join(names)}"
        if not np.array_equal(placing.base, np.eye(4)):
            yield f"the arm's base is at {_text(placing.base)} of the file's root"
        if not np.array_equal(job.robot.base.pose, np.eye(4)):
            yield "the calibrated base frame is not written: the file's root stays where it is"
        tool = job.frames.at_zero[-1] @ job.robot.tool.pose
        has_tool = not np.allclose(job.robot.tool.pose, np.eye(4), atol=1e-12)
        if has_tool or not placing.ends:
            last = placing.moves[len(names)] @ placing.model.at_zero(placing.chain[-1].frame)
            yield (
                f"the tool is not written; in the frame of the file's joint '{names[-1]}' it is at "
                f"{_text(se3.inverse(last) @ placing.base @ tool)}"
            )


@lru_cache(maxsize=1)
def _placing(form: IntoForm, job: Job) -> Placing:
    """The calibrated arm in the file; of the last job, which is written, read back and noted."""
    if job.source is None:
        raise OptionError(f"--for {form.name} needs --into FILE, the model that gets the calibrated numbers")
    nominal = joint_frames(job.require_before(form.name))
    return place(form.parse(job.source), joint_names(job.robot), nominal, job.frames)


def _text(pose: Matrix4) -> str:
    xyz = ", ".join(f"{1e3 * v:.4f}" for v in pose[:3, 3])
    return (
        f"{xyz} mm, rotation vector {', '.join(f'{v:.7f}' for v in se3.matrix_to_rotvec(pose[:3, :3]))} rad"
    )


URDF = IntoForm("urdf", "your own URDF with the calibrated numbers (--into FILE)", ".urdf")
XACRO = IntoForm("xacro", "your own xacro with the calibrated numbers (--into FILE)", ".xacro")
SDF = IntoForm("sdf", "your own SDF with the calibrated numbers (--into FILE)", ".sdf", sdf_model)
MJCF = IntoForm("mjcf", "your own MJCF with the calibrated numbers", ".xml", mjcf_model)
"""Part of the form that also writes a new file."""
