"""What a pendant's numbers mean, found from the arm: units, kind of orientation, rounding.

For each meaning the nominal arm is brought to the poses with the best base and tool, both in closed form.
Under the right one it is off by its production errors, under any other by far more.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import Frame
from workbench.arm.joint_units import sliding
from workbench.arm.kinematics.forward import geometric_jacobian, tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.hand_eye import base_and_tool
from workbench.base.types import Freedom
from workbench.base.wording import in_mm
from workbench.data.dataset import Dataset
from workbench.data.orientations import Orientation
from workbench.data.plausibility import refuse_joint_units
from workbench.extras.pendant.own_robot.displayed_poses import SIZES, DisplayedPoses, meanings
from workbench.extras.pendant.readings import PendantReadings
from workbench.identification.checks.arm_match import arm_match

MIN_POSES = 5
"""Poses that distinguish one convention from another."""
TURNED = float(np.deg2rad(3.0))
"""Median angle that the right convention leaves at most [rad]."""
MIN_SECOND_TURN = 0.1
"""Root mean square angle about a second axis that the poses need [rad]."""
MAX_MISFIT, SMALL_MISFIT = 0.045, 0.004
"""Shares of the reach beyond which readings are of no such arm, and below which no other arm is tried."""
CLEARLY = 3.0
"""The right convention fits this many times better than any that means other poses."""
UNIFORM = 1.0 / np.sqrt(12.0)
"""Standard deviation of rounding, in steps."""
EXACT_SIGMA = (1e-7, 1e-7)
"""Standard deviations of numbers that are exact [m], [rad]."""


@dataclass(frozen=True, eq=False)
class Convention:
    """One meaning of the readings, and how the nominal arm suits it.

    Args:
        base: Of the nominal arm in the frame of the display, as it suits the poses best.
        tool: Likewise in the arm's flange.
        position: Median distance from the nominal arm with the best base and tool [m].
        rotation: Median angle there [rad].
    """

    meaning: DisplayedPoses
    base: Float[np.ndarray, "4 4"]
    tool: Float[np.ndarray, "4 4"]
    position: float
    rotation: float

    def cost(self, robot: Robot) -> float:
        """Error as an angle, lengths in parts of the reach."""
        return float(np.hypot(self.position / robot.reach, self.rotation))


def find_convention(robot: Robot, readings: PendantReadings) -> Convention:
    """The meaning under which the readings are this arm's.

    Raises:
        DataError: too few poses, no meaning fits, several do, or the readings are of another arm.
    """
    robot.check_joints(readings.joints, readings.source)
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
    if best.rotation > TURNED or best.position > MAX_MISFIT * robot.reach:
        raise DataError(_why_not(robot, readings, best))
    rival = next((c for c in found[1:] if not _same(c, best)), None)
    if rival is not None and rival.cost(robot) < CLEARLY * max(best.cost(robot), 1e-6):
        raise DataError(
            f"{readings.source}: the poses fit as {best.meaning.text}, and nearly as well as "
            f"{rival.meaning.text}; add "
            "poses with the tool turned about all axes"
        )
    if best.position > SMALL_MISFIT * robot.reach:
        match = arm_match(robot, _positions(best.meaning, readings))
        if match.is_foreign:
            raise DataError(f"{readings.source}: {match.text}; {match.remedy}")
    return best


def with_displayed_frames(robot: Robot, convention: Convention) -> Robot:
    """The nominal arm in the frame of the display; the rows decide on what may be there or not."""
    found = {"base": convention.base, "tool": convention.tool}
    frames = {
        name: Frame.from_pose(pose, Freedom.FREE) if _is_set(pose, robot.reach) else Frame(free=Freedom.AUTO)
        for name, pose in found.items()
    }
    return robot.bare.with_frames(**frames)


def _is_set(pose: np.ndarray, reach: float) -> bool:
    """Whether a frame is farther from none than production errors explain."""
    turn = np.linalg.norm(se3.matrix_to_rotvec(pose[:3, :3]))
    return bool(turn > TURNED or np.linalg.norm(pose[:3, 3]) > MAX_MISFIT * reach)


def as_dataset(robot: Robot, readings: PendantReadings, meaning: DisplayedPoses) -> Dataset:
    """The readings in SI, each with the standard deviation that rounding gives it."""
    joint, length, angle = (
        step * SIZES[unit] for step, unit in zip(readings.steps, meaning.units, strict=True)
    )
    turn = readings.turn * SIZES[meaning.units[2]]
    variance = np.empty((len(readings), 6))
    variance[:, :3] = (UNIFORM * length) ** 2
    variance[:, 3:] = _turned_by(meaning.orientation, turn, UNIFORM * angle)
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
    for meaning in meanings(readings.joints, readings.xyz, readings.turn, slides, units=readings.units):
        arm = tool_poses(bare, Motion(meaning.q))
        if not _turns(arm):
            continue
        base, tool = base_and_tool(arm, meaning.poses)
        error = se3.pose_error(meaning.poses, base @ arm @ tool)
        position, rotation = (float(np.median(np.linalg.norm(error[:, p], axis=1))) for p in PARTS)
        yield Convention(meaning, base, tool, position, rotation)


def _turns(arm: np.ndarray) -> bool:
    """Whether the tool is turned about more than one axis; else the poses fit in several conventions."""
    turns = se3.matrix_to_rotvec(arm[:, :3, :3] @ arm[0, :3, :3].T)
    return bool(np.linalg.svd(turns, compute_uv=False)[1] > MIN_SECOND_TURN * np.sqrt(len(turns)))


PARTS = (slice(0, 3), slice(3, 6))


def _turned_by(kind: Orientation, turn: np.ndarray, sigma: float) -> np.ndarray:
    """Variances of the rotation about the base's axes where each number is uncertain by sigma."""
    at, total = kind.matrices(turn), np.zeros((len(turn), 3))
    for k in range(turn.shape[1]):
        moved = turn + 1e-6 * np.eye(turn.shape[1])[k]
        change = se3.matrix_to_rotvec(kind.matrices(moved) @ at.swapaxes(1, 2)) / 1e-6
        total += (sigma * change) ** 2
    return total


def _positions(meaning: DisplayedPoses, readings: PendantReadings) -> Dataset:
    return Dataset(q=meaning.q, position=meaning.poses[:, :3, 3], source=readings.source)


def _same(a: Convention, b: Convention) -> bool:
    return all(np.allclose(p, q, atol=1e-6) for p, q in zip(a.meaning[:2], b.meaning[:2], strict=True))


def _why_not(robot: Robot, readings: PendantReadings, best: Convention) -> str:
    """What is wrong with readings that fit under no meaning."""
    match = arm_match(robot, _positions(best.meaning, readings))
    if match.is_foreign:
        return f"{readings.source}: {match.text}; {match.remedy}"
    off = f"{in_mm(best.position)} and {np.rad2deg(best.rotation):.2g}° off"
    return (
        f"{readings.source}: no convention fits {robot.name}: the best, {best.meaning.text}, is {off}; check "
        "columns and robot, or let 'workbench new' find the pendant's signs and offsets of joints"
    )
