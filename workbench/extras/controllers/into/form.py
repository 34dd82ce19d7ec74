"""`export --for urdf|xacro|sdf|mjcf --into FILE`: where the arm stands in a file, and how its frames move."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from workbench.arm.joint import JointKind
from workbench.arm.joint_frames import JointFrame, JointFrames, joint_frames
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import FileError, OptionError
from workbench.base.types import Matrix4, Vector3, frozen
from workbench.base.wording import in_mm
from workbench.exports.export_format import AbstractForm, Job
from workbench.extras.controllers.into.formats import mjcf_model, sdf_model, urdf_model
from workbench.extras.controllers.into.model import Edge, Model
from workbench.extras.controllers.into.xml_bytes import FILE, Edit, edited
from workbench.extras.controllers.joint_names import joint_names

FAR, ANGLE = 2e-3, np.deg2rad(0.5)
"""Distance [m] and angle [rad] of an axis from nominal that rounding in a model file explains."""
GAUSS_NEWTON_STEPS = 20
"""Gauss–Newton steps; they converge in about five."""
SAME = 1e-12
"""Change of a pose [m or rad] that is none."""

Line = tuple[Vector3, Vector3]


@dataclass(frozen=True, eq=False)
class Placing:
    """The arm in a file.

    Args:
        model: The file.
        chain: Its joints that are the arm's.
        by_name: Whether they were found by their names.
        base: The arm's base in the file's root.
        moves: What the calibration does to the frames in the root, by class of body (`Model.classes`).
    """

    model: Model
    chain: list[Edge]
    by_name: bool
    base: Matrix4
    moves: list[Matrix4]

    @property
    def ends(self) -> list[str]:
        """Frames fixed to the last body, which the flange's correction goes into."""
        classes = self.model.classes(self.chain)
        return [n for n, f in self.model.frames.items() if classes[f.body] > len(self.chain)]

    @property
    def edits(self) -> list[Edit]:
        classes, found = self.model.classes(self.chain), []
        bodies = {name: f.body for name, f in self.model.frames.items()}
        for name, given in self.model.frames.items():
            own, other = classes[given.body], classes.get(bodies.get(given.reference, given.reference), 0)
            if own == other:
                continue
            old = given.read()
            around = self.moves[other] @ self.model.at_zero(given.reference)
            new = se3.inverse(around) @ self.moves[own] @ self.model.at_zero(name)
            if np.abs(new - old).max() > SAME:
                found += given.write(new)
        return found


@final
@dataclass(frozen=True)
class IntoForm(AbstractForm):
    """A model file that gets other numbers."""

    name: str = ""
    title: str = ""
    ending: str = ""  # type: ignore[misc]
    parse: Callable[[str], Model] = urdf_model
    needs_source = True

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
        raise OptionError(f"--for {form.name} needs --into FILE, the model to update", option="--into")
    nominal = joint_frames(job.require_before(form.name))
    return place(form.parse(job.source), joint_names(job.robot), nominal, job.frames)


def _text(pose: Matrix4) -> str:
    xyz = ", ".join(f"{1e3 * v:.4f}" for v in pose[:3, 3])
    return (
        f"{xyz} mm, rotation vector {', '.join(f'{v:.7f}' for v in se3.matrix_to_rotvec(pose[:3, :3]))} rad"
    )


def place(model: Model, names: list[str], nominal: JointFrames, calibrated: JointFrames) -> Placing:
    """The nominal arm in a file, and how the calibration moves it."""
    chain, by_name = model.chain(names)
    turning = [j.joint.kind is JointKind.REVOLUTE for j in nominal.joints]
    odd = [e.name for e, turns in zip(chain, turning, strict=True) if (e.kind is JointKind.REVOLUTE) != turns]
    if odd:
        raise FileError(
            f"joint '{odd[0]}' is revolute where the calibrated arm is prismatic, or the reverse", path=FILE
        )
    found = [model.line(e) for e in chain]
    base = _base(lines(nominal), found, turning)
    far, angle = _apart(base, lines(nominal), found, turning)
    if far.max() > FAR or angle.max() > ANGLE:
        worst = int(np.argmax(np.maximum(far / FAR, angle / ANGLE)))
        raise FileError(
            f"does not match the nominal arm of the calibration: the axis of joint '{chain[worst].name}' "
            f"is {in_mm(far[worst])} and {np.rad2deg(angle[worst]):.2g}° off (limits {in_mm(FAR)} and "
            f"{np.rad2deg(ANGLE):.1g}°); give the nominal model",
            path=FILE,
        )
    shifts = [
        base @ c @ se3.inverse(n) @ se3.inverse(base)
        for c, n in zip(calibrated.at_zero, nominal.at_zero, strict=True)
    ]
    wanted = [_moved(base, line) for line in lines(calibrated)]
    onto = [
        _onto(_moved(d, old), new, turns) @ d
        for d, old, new, turns in zip(shifts, found, wanted, turning, strict=False)
    ]
    return Placing(model, chain, by_name, base, [np.eye(4), *onto, shifts[-1]])


def lines(frames: JointFrames) -> list[Line]:
    """Point and direction of every joint's axis at zero, in the arm's base."""
    return [(p[:3, 3], p[:3, :3] @ j.axis) for p, j in zip(frames.at_zero, frames.joints, strict=False)]


def _moved(pose: Matrix4, line: Line) -> Line:
    return se3.apply(pose, line[0]), pose[:3, :3] @ line[1]


def _onto(old: Line, new: Line, turns: bool) -> Matrix4:
    """The smallest motion that brings one axis onto another; of a slide, its direction alone."""
    normal, cosine = np.cross(old[1], new[1]), float(old[1] @ new[1])
    sine = float(np.linalg.norm(normal))
    turn = se3.rotvec_to_matrix(normal / sine * np.arctan2(sine, cosine) if sine > 0.0 else np.zeros(3))
    across = new[0] - old[0] if turns else np.zeros(3)
    across = across - new[1] * (new[1] @ across)
    return se3.pose(turn, old[0] + across - turn @ old[0])


def _apart(
    base: Matrix4, own: list[Line], found: list[Line], turning: list[bool]
) -> tuple[np.ndarray, np.ndarray]:
    """Distances and angles between the axes of the arm at a place and those of the file [m], [rad]."""
    far, angle = [], []
    for line, (point, axis), turns in zip(own, found, turning, strict=True):
        p, u = _moved(base, line)
        far.append(np.linalg.norm(np.cross(axis, point - p)) if turns else 0.0)
        angle.append(np.arctan2(np.linalg.norm(np.cross(u, axis)), u @ axis))
    return np.array(far), np.array(angle)


def _base(own: list[Line], found: list[Line], turning: list[bool]) -> Matrix4:
    """The place of the arm's base at which its axes are nearest to the file's; the root if they are there."""
    far, angle = _apart(np.eye(4), own, found, turning)
    if far.max() <= FAR and angle.max() <= ANGLE:
        return np.eye(4)
    tries = []
    for start in Rotation.create_group("O").as_matrix():
        here = se3.pose(start, np.zeros(3))
        for _ in range(GAUSS_NEWTON_STEPS):
            before, here = here, _nearer(here, own, found, turning)
            if np.abs(here - before).max() < SAME:
                break
        tries.append(here)
    return min(tries, key=lambda here: float(np.linalg.norm(_apart(here, own, found, turning))))


def _nearer(here: Matrix4, own: list[Line], found: list[Line], turning: list[bool]) -> Matrix4:
    """One Gauss–Newton step; what the axes leave open (parallel ones) stays as it is."""
    rows, left = [], []
    for line, (point, axis), turns in zip(own, found, turning, strict=True):
        p, u = _moved(here, line)
        across = (np.eye(3) - np.outer(axis, axis)) * turns
        rows += [np.hstack([np.zeros((3, 3)), -se3.skew(u)]), across @ np.hstack([np.eye(3), -se3.skew(p)])]
        left += [axis - u, across @ (point - p)]
    step = np.linalg.lstsq(np.vstack(rows), np.concatenate(left), rcond=1e-9)[0]
    return se3.pose(se3.rotvec_to_matrix(step[3:]), step[:3]) @ here


URDF = IntoForm("urdf", "your own URDF with the calibrated numbers (--into FILE)", ".urdf")
XACRO = IntoForm("xacro", "your own xacro with the calibrated numbers (--into FILE)", ".xacro")
SDF = IntoForm("sdf", "your own SDF with the calibrated numbers (--into FILE)", ".sdf", sdf_model)
MJCF = IntoForm("mjcf", "your own MJCF with the calibrated numbers", ".xml", mjcf_model)
"""Part of the form that also writes a new file."""
