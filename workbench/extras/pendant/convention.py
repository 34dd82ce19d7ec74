"""What a pendant's numbers mean, found from the arm: units, kind of orientation, rounding.

For each meaning the nominal arm is brought to the poses with the best base and tool, both in closed form.
Under the right one it is off by its production errors, under any other by far more.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import Frame
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import geometric_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.own_robot.readings import SIZES, possible
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.hand_eye import hand_eye, mean_base
from workbench.base.types import Freedom
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.data.plausibility import refuse_joint_units
from workbench.extras.pendant.orientations import ORIENTATIONS, Orientation
from workbench.extras.pendant.readings import PendantReadings
from workbench.identification.arm_match import CLOSE, SOME, arm_match

MIN_POSES = 5
"""Poses that distinguish one convention from another."""
TURNED = float(np.deg2rad(3.0))
"""Median angle that the right convention leaves at most [rad]."""
TURNS = 0.1
"""Root mean square angle about a second axis that the poses need [rad]."""
CLEARLY = 3.0
"""The right convention fits this many times better than any that means other poses."""
UNIFORM = 1.0 / np.sqrt(12.0)
"""Standard deviation of rounding, in steps."""
EXACT_SIGMA = (1e-7, 1e-7)
"""Standard deviations of numbers that are exact [m], [rad]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Convention:
    """One meaning of the readings.

    Args:
        q: Joint positions [rad or m].
        poses: Of the tool, as displayed.
        units: Of joints, positions and angles.
        orientation: Kind of the orientation.
        base: Of the nominal arm in the frame of the display, as it suits the poses best.
        tool: Likewise in the arm's flange.
        position: Median distance from the nominal arm with the best base and tool [m].
        rotation: Median angle there [rad].
    """

    q: Float[np.ndarray, "rows n"]
    poses: Float[np.ndarray, "rows 4 4"]
    units: tuple[str, str, str]
    orientation: Orientation
    base: Float[np.ndarray, "4 4"]
    tool: Float[np.ndarray, "4 4"]
    position: float
    rotation: float

    @property
    def text(self) -> str:
        """`joints in deg, positions in mm, rotation vector (UR) in rad`."""
        joints, lengths, angles = self.units
        turned = f" in {angles}" if self.orientation.has_units else ""
        return f"joints in {joints}, positions in {lengths}, {self.orientation.text}{turned}"

    def cost(self, robot: Robot) -> float:
        """Error as an angle, lengths in parts of the reach."""
        return float(np.hypot(self.position / robot.reach, self.rotation))


def find_convention(robot: Robot, readings: PendantReadings) -> Convention:
    """The meaning under which the readings are this arm's.

    Raises:
        DataError: too few poses, no meaning fits, several do, or the readings are of another arm.
    """
    if len(readings) < MIN_POSES:
        raise DataError(
            f"{readings.source}: {len(readings)} poses do not determine the convention; read at least "
            f"{MIN_POSES}, and about 30 to extract the model"
        )
    found = sorted(_tried(robot, readings), key=lambda c: c.cost(robot))
    if not found:
        raise DataError(
            f"{readings.source}: the tool is turned about one axis only, which fits in several conventions; "
            "add poses with the tool turned about all axes (if the joints are in rad, head them q1[rad] …)"
        )
    best = found[0]
    if best.rotation > TURNED or best.position > SOME * robot.reach:
        raise DataError(_why_not(robot, readings, best))
    rival = next((c for c in found[1:] if not _same(c, best)), None)
    if rival is not None and rival.cost(robot) < CLEARLY * max(best.cost(robot), 1e-6):
        raise DataError(
            f"{readings.source}: the poses fit as {best.text}, and nearly as well as {rival.text}; add "
            "poses with the tool turned about all axes"
        )
    if best.position > CLOSE * robot.reach:
        match = arm_match(robot, _positions(best, readings), some=CLOSE)
        if match.is_foreign:
            raise DataError(f"{readings.source}: {match.text}; {match.remedy}")
    return best


def with_displayed_frames(robot: Robot, meaning: Convention) -> Robot:
    """The nominal arm in the frame of the display; the rows decide on what may be there or not."""
    found = {"base": meaning.base, "tool": meaning.tool}
    frames = {
        name: Frame.from_pose(pose, Freedom.FREE) if _is_set(pose, robot.reach) else Frame(free=Freedom.AUTO)
        for name, pose in found.items()
    }
    return robot.bare.with_frames(**frames)


def _is_set(pose: np.ndarray, reach: float) -> bool:
    """Whether a frame is farther from none than production errors explain."""
    turn = np.linalg.norm(se3.matrix_to_rotvec(pose[:3, :3]))
    return bool(turn > TURNED or np.linalg.norm(pose[:3, 3]) > SOME * reach)


def as_dataset(robot: Robot, readings: PendantReadings, meaning: Convention) -> Dataset:
    """The readings in SI, each with the standard deviation that rounding gives it."""
    joint, length, angle = (
        step * SIZES.get(unit, 1.0) for step, unit in zip(readings.steps, meaning.units, strict=True)
    )
    turn = _numbers(readings, meaning.orientation, meaning.units[2])
    step = angle if meaning.orientation.has_units else readings.steps[2]
    variance = np.empty((len(readings), 6))
    variance[:, :3] = (UNIFORM * length) ** 2
    variance[:, 3:] = _turned_by(meaning.orientation, turn, UNIFORM * step)
    if joint:
        slides = sliding(robot)
        shares = np.where(slides, SIZES[meaning.units[1]] * readings.steps[0], joint) * UNIFORM
        variance += ((geometric_jacobian(robot, meaning.q) * shares) ** 2).sum(2)
    sigma = np.sqrt(np.maximum(variance, np.repeat(EXACT_SIGMA, 3) ** 2))
    return Dataset(
        q=meaning.q,
        position=meaning.poses[:, :3, 3],
        rotation=meaning.poses[:, :3, :3],
        row=np.array(readings.rows),
        sigma=sigma,
        source=readings.source,
    )


def _tried(robot: Robot, readings: PendantReadings) -> Iterator[Convention]:
    slides = sliding(robot)
    if "rad" in readings.units[0]:
        refuse_joint_units(readings.joints, robot.limits, readings.source)
    bare = robot.bare
    own = readings.units
    joints = [own[0]] if own[0] else possible(("deg", "rad"), readings.joints[:, ~slides])
    lengths = [own[1]] if own[1] else possible(("mm", "m"), readings.xyz)
    for joint, length in product(joints, lengths):
        q = readings.joints * np.where(slides, SIZES[length], SIZES[joint])
        arm = tool_poses(bare, Motion(q))
        if not _turns(arm):
            continue
        xyz = readings.xyz * SIZES[length]
        for kind in ORIENTATIONS:
            if kind.numbers != readings.turn.shape[1]:
                continue
            units = [own[2]] if own[2] else possible(("deg", "rad"), readings.turn)
            for angle in units if kind.has_units else ("",):
                poses = se3.pose(kind.matrices(_numbers(readings, kind, angle)), xyz)
                tool = hand_eye(arm, poses)
                base = mean_base(arm @ tool, poses)
                error = se3.pose_error(poses, base @ arm @ tool)
                position, rotation = (np.median(np.linalg.norm(error[:, p], axis=1)) for p in PARTS)
                yield Convention(
                    q=q,
                    poses=poses,
                    units=(joint, length, angle),
                    orientation=kind,
                    base=base,
                    tool=tool,
                    position=float(position),
                    rotation=float(rotation),
                )


def _turns(arm: np.ndarray) -> bool:
    """Whether the tool is turned about more than one axis; else the poses fit in several conventions."""
    turns = se3.matrix_to_rotvec(arm[:, :3, :3] @ arm[0, :3, :3].T)
    return bool(np.linalg.svd(turns, compute_uv=False)[1] > TURNS * np.sqrt(len(turns)))


PARTS = (slice(0, 3), slice(3, 6))


def _numbers(readings: PendantReadings, kind: Orientation, unit: str) -> np.ndarray:
    return readings.turn * (SIZES[unit] if kind.has_units else 1.0)


def _turned_by(kind: Orientation, turn: np.ndarray, sigma: float) -> np.ndarray:
    """Variances of the rotation about the base's axes where each number is uncertain by sigma."""
    at, total = kind.matrices(turn), np.zeros((len(turn), 3))
    for k in range(turn.shape[1]):
        moved = turn + 1e-6 * np.eye(turn.shape[1])[k]
        change = se3.matrix_to_rotvec(kind.matrices(moved) @ at.swapaxes(1, 2)) / 1e-6
        total += (sigma * change) ** 2
    return total


def _positions(meaning: Convention, readings: PendantReadings) -> Dataset:
    return Dataset(q=meaning.q, position=meaning.poses[:, :3, 3], source=readings.source)


def _same(a: Convention, b: Convention) -> bool:
    return bool(np.allclose(a.poses, b.poses, atol=1e-6) and np.allclose(a.q, b.q))


def _why_not(robot: Robot, readings: PendantReadings, best: Convention) -> str:
    """What is wrong with readings that fit under no meaning."""
    match = arm_match(robot, _positions(best, readings), some=CLOSE)
    if match.is_foreign:
        return f"{readings.source}: {match.text}; {match.remedy}"
    off = f"{in_mm(best.position)} and {np.rad2deg(best.rotation):.2g}° off"
    return (
        f"{readings.source}: no convention fits {robot.name}: the best, {best.text}, is {off}; check the "
        "columns and the robot, or let 'workbench new' find how the pendant counts its joints"
    )
