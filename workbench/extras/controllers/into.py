"""`export --for urdf|mjcf --into FILE`: the calibrated arm in a model file of the user's own.

    D_k = X C_k N_k⁻¹ X⁻¹    how far the calibration moved what hangs on joint k (and the flange)
    new pose = (D_parent G_parent)⁻¹ D_own G_own    of every frame whose parent moves otherwise

N and C are nominal and calibrated frames at zero, G those of the file, X the arm's base in it. D_k is
then brought exactly onto the calibrated joint's axis, as the file's nominal numbers may be rounded; as
T(q) = Π exp(ξ_k q_k) T(0), axes and flange at zero are all that counts. Comments and all else stay.
"""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, final

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from workbench.arm.joint import JointKind
from workbench.arm.joint_frames import JointFrame, JointFrames, joint_frames
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import FileError, OptionError
from workbench.base.types import Matrix4, frozen
from workbench.base.wording import in_mm
from workbench.exports.export_format import AbstractForm, Job
from workbench.extras.controllers.joint_names import joint_names
from workbench.extras.controllers.model_files import FILE, URDF, Line, ModelFormat, ModelFrame, parse

MARK = " calibrated by workbench "
"""Comment in a file that has a calibration."""
FAR, ANGLE = 2e-3, np.deg2rad(0.5)
"""Distance [m] and angle [rad] of an axis from nominal that rounding in a model file explains."""
SAME = 1e-12
"""Change of a pose [m or rad] that is none."""


@dataclass(frozen=True, eq=False)
class Placing:
    """The arm in a file.

    Args:
        root: The file.
        frames: All of its frames.
        chain: Those that the arm's joints move.
        is_named: Whether they were found by their names.
        base: The arm's base in the file's root.
        moves: What the calibration does before the arm, behind each joint, and to what is fixed to the last.
    """

    root: Any
    frames: list[ModelFrame]
    chain: list[ModelFrame]
    is_named: bool
    base: Matrix4
    moves: list[Matrix4]

    def number(self, frame: ModelFrame | None) -> int:
        """Which of the moves takes a frame along."""
        for depth, here in enumerate([] if frame is None else frame.upwards):
            if here in self.chain:
                number = self.chain.index(here) + 1
                return number + (number == len(self.chain) and depth > 0)
        return 0

    @property
    def end(self) -> int | None:
        """Place of a frame that is fixed to the last link: it takes the flange's correction."""
        return next((k for k, f in enumerate(self.frames) if self.number(f) > len(self.chain)), None)


@final
class Urdf(AbstractForm):
    """A URDF that gets other numbers."""

    name = "urdf"
    title = "your own URDF with the calibrated numbers (--into FILE)"
    ending = ".urdf"
    needs_source = True

    def write(self, job: Job) -> str:
        return write_into(URDF, job)

    def read(self, text: str, job: Job) -> Robot:
        return read_back(URDF, text, job)

    def notes(self, job: Job) -> Iterable[str]:
        return notes_of(URDF, job)


def write_into(form: ModelFormat, job: Job) -> str:
    """The file with the calibrated numbers."""
    placing = _placing(form, job)
    root, moves = placing.root, placing.moves
    for frame in placing.frames:
        own, other = placing.number(frame), placing.number(frame.parent)
        around = moves[other] @ (np.eye(4) if frame.parent is None else frame.parent.at_zero)
        new = se3.inverse(around) @ moves[own] @ frame.at_zero
        if own != other and np.abs(new - frame.pose).max() > SAME:
            form.give(frame.node, new)
    mark = etree.Comment(MARK)
    mark.tail = root.text
    root.insert(0, mark)
    is_declared = str(job.source).startswith("<?xml")
    return etree.tostring(root.getroottree(), encoding="utf-8", xml_declaration=is_declared).decode() + "\n"


def read_back(form: ModelFormat, text: str, job: Job) -> Robot:
    """The arm of a written file."""
    placing, own, new = _placing(form, job), job.frames, form.frames_of(parse(text))
    base, here, joints = se3.inverse(placing.base), np.eye(4), []
    for joint, frame in zip(own.joints, placing.chain, strict=True):
        now = new[placing.frames.index(frame)]
        point, axis = now.line
        at = base @ now.at_zero @ se3.pose(np.eye(3), point)
        step = frozen(se3.inverse(here) @ at)
        joints.append(JointFrame(joint.joint, step, frozen(axis / np.linalg.norm(axis))))
        here = at
    flange = own.at_zero[-1]
    if (end := placing.end) is not None:
        nominal = joint_frames(job.require_before(form.name)).at_zero[-1]
        moved = new[end].at_zero @ se3.inverse(placing.frames[end].at_zero)
        flange = base @ moved @ placing.base @ nominal
    return JointFrames(tuple(joints), frozen(se3.inverse(here) @ flange)).robot(job.robot)


def notes_of(form: ModelFormat, job: Job) -> Iterable[str]:
    placing, robot = _placing(form, job), job.robot
    names = [frame.joint for frame in placing.chain]
    if not placing.is_named:
        yield f"joints matched by their order, as their names differ: {', '.join(names)}"
    if not np.array_equal(placing.base, np.eye(4)):
        yield f"the arm's base is at {_text(placing.base)} of the file's root"
    if not np.array_equal(robot.base.pose, np.eye(4)):
        yield "the calibrated base frame is not written: the file's root stays where it is"
    if placing.end is None or not np.allclose(robot.tool.pose, np.eye(4), atol=SAME):
        last = placing.moves[len(names)] @ placing.chain[-1].at_zero
        tool = se3.inverse(last) @ placing.base @ job.frames.at_zero[-1] @ robot.tool.pose
        where = f"in the frame of the file's joint '{names[-1]}' it is at {_text(tool)}"
        yield f"the tool is not written; {where}"


def _text(pose: Matrix4) -> str:
    xyz = ", ".join(f"{1e3 * v:.4f}" for v in pose[:3, 3])
    turn = ", ".join(f"{v:.7f}" for v in se3.matrix_to_rotvec(pose[:3, :3]))
    return f"{xyz} mm, rotation vector {turn} rad"


@lru_cache(maxsize=1)
def _placing(form: ModelFormat, job: Job) -> Placing:
    """The nominal arm in the file of a job, and how the calibration moves it; of the last job."""
    if job.source is None:
        raise OptionError(f"--for {form.name} needs --into FILE, the model to update", option="--into")
    nominal, root = joint_frames(job.require_before(form.name)), parse(job.source)
    if root.tag != form.tag:
        wrong = f"its root is <{root.tag}>, not <{form.tag}>"
        raise FileError(f"{wrong}; give a file of the format named by --for", path=FILE)
    if any(node.text == MARK for node in root.iter(etree.Comment)):
        raise FileError("has a calibration already; give the nominal model", path=FILE)
    frames = form.frames_of(root)
    chain, is_named = _chain(frames, joint_names(job.robot))
    kinds = [joint.joint.kind for joint in nominal.joints]
    for frame, kind in zip(chain, kinds, strict=True):
        if frame.kind is not kind:
            raise FileError(f"joint '{frame.joint}' is not {kind}, unlike that of the arm", path=FILE)
    slides = np.array([kind is JointKind.PRISMATIC for kind in kinds])
    found, own = [_moved(frame.at_zero, frame.line) for frame in chain], _lines(nominal)
    base = _base(own, found, slides)
    far, angle = _apart(base, own, found, slides)
    if max(far.max() / FAR, angle.max() / ANGLE) > 1.0:
        worst = int(np.argmax(np.maximum(far / FAR, angle / ANGLE)))
        raise FileError(
            f"does not match the nominal arm of the calibration: the axis of joint '{chain[worst].joint}' "
            f"is {in_mm(far[worst])} and {np.rad2deg(angle[worst]):.2g}° off (limits {in_mm(FAR)} and "
            f"{np.rad2deg(ANGLE):.1g}°); give the nominal model",
            path=FILE,
        )
    pairs = zip(job.frames.at_zero, nominal.at_zero, strict=True)
    moves = [base @ c @ se3.inverse(base @ n) for c, n in pairs]
    for k, (line, wanted) in enumerate(zip(found, _lines(job.frames), strict=True)):
        moves[k] = _onto(_moved(moves[k], line), _moved(base, wanted), slides[k]) @ moves[k]
    return Placing(root, frames, chain, is_named, base, [np.eye(4), *moves])


def _chain(frames: list[ModelFrame], names: list[str]) -> tuple[list[ModelFrame], bool]:
    """The arm's joints from base to flange, by their names or else by their order."""
    found = {frame.joint: frame for frame in frames if frame.kind is not JointKind.FIXED}
    if missing := [name for name in names if name not in found]:
        if len(missing) < len(names):
            raise FileError(f"has no joint '{missing[0]}', which the calibration has", path=FILE)
        arms = [path for frame in found.values() if len(path := frame.path) == len(names)]
        if len(arms) != 1:
            what = f"{len(arms)} arms of {len(names)} joints in series, and none called {names[0]}"
            raise FileError(f"has {what}; give the model of one arm", path=FILE)
        return arms[0], False
    path = found[names[-1]].path[-len(names) :]
    if [frame.joint for frame in path] != names:
        raise FileError(f"has other joints in between, or another order than {', '.join(names)}", path=FILE)
    return path, True


def _lines(frames: JointFrames) -> list[Line]:
    """Every joint's axis at zero, in the arm's base."""
    return [(p[:3, 3], p[:3, :3] @ j.axis) for p, j in zip(frames.at_zero, frames.joints, strict=False)]


def _moved(pose: Matrix4, line: Line) -> Line:
    point, axis = line
    return se3.apply(pose, point), pose[:3, :3] @ axis / np.linalg.norm(axis)


def _onto(old: Line, new: Line, slides: bool) -> Matrix4:
    """The smallest motion that brings one axis onto another; of a slide, its direction alone."""
    normal = np.cross(old[1], new[1])
    sine = float(np.linalg.norm(normal))
    turn = se3.rotvec_to_matrix(normal * (np.arctan2(sine, old[1] @ new[1]) / max(sine, 1e-300)))
    across = np.zeros(3) if slides else np.cross(new[1], np.cross(new[0] - old[0], new[1]))
    return se3.pose(turn, old[0] + across - turn @ old[0])


def _apart(base: Matrix4, own: list[Line], found: list[Line], slides: np.ndarray) -> tuple[np.ndarray, ...]:
    """Distances and angles between the axes of the arm at a place and those of the file [m], [rad]."""
    pairs = [(*_moved(base, line), *other) for line, other in zip(own, found, strict=True)]
    far = np.array([np.linalg.norm(np.cross(axis, point - p)) for p, _, point, axis in pairs])
    angle = [np.arctan2(np.linalg.norm(np.cross(u, axis)), u @ axis) for _, u, _, axis in pairs]
    return np.where(slides, 0.0, far), np.array(angle)


def _base(own: list[Line], found: list[Line], slides: np.ndarray) -> Matrix4:
    """The place of the arm's base at which its axes are nearest to the file's; the root if they are there.

    Directions of axes, and of what separates parallel neighbours, turn with the base.
    """
    far, angle = _apart(np.eye(4), own, found, slides)
    if far.max() <= FAR and angle.max() <= ANGLE:
        return np.eye(4)
    directions = [[axis for _, axis in lines] for lines in (own, found)]
    for k in np.flatnonzero(~(slides[:-1] | slides[1:])):
        gaps = [np.cross(lines[k][1], lines[k + 1][0] - lines[k][0]) for lines in (own, found)]
        if np.linalg.norm(np.cross(own[k][1], own[k + 1][1])) < ANGLE and np.linalg.norm(gaps[0]) > FAR:
            for side, gap in zip(directions, gaps, strict=True):
                side.append(gap)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of axes that are all parallel; they are compared afterwards
        turn = Rotation.align_vectors(directions[1], directions[0])[0].as_matrix()
    across = [
        (np.eye(3) - np.outer(axis, axis)) * (not s) for (_, axis), s in zip(found, slides, strict=True)
    ]
    left = [a @ (f - turn @ p) for a, (f, _), (p, _) in zip(across, found, own, strict=True)]
    return se3.pose(turn, np.linalg.lstsq(np.vstack(across), np.concatenate(left), rcond=1e-9)[0])
