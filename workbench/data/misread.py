"""Detecting misread measurements by comparison with the arm.

A quaternion in another order, or of the opposite turn, is a rotation all the same, and metres that are called
millimetres are lengths: only an arm that can't have moved like that gives them away.
"""

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.posed_arm import posed_arm
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.base.hand_eye import nearest_rotation
from workbench.data.dataset import Dataset
from workbench.data.plausibility import check_plausible

WRONG, RIGHT = np.radians(20.0), np.radians(8.0)
"""Turns farther than the first from the arm's are misread if another reading is nearer than the second."""
MIN_ROWS = 5
"""Rows that tell."""
MAX_ROWS = 500
"""Rows that are looked at."""
ENDS = np.radians(150.0)
"""Turns beyond this are left out where a direction is sought: theirs is uncertain."""


def checked(robot: Robot, dataset: Dataset) -> Dataset:
    """The same measurements, with a note on everything odd about them for this arm."""
    if dataset.readings is not None and dataset.readings.has_tool_poses and robot is not posed_arm():
        raise DataError(
            f"{dataset.source}: poses of the tool were given in place of joints, so robot '{robot.name}' "
            "can't be judged; give the joints, or only identify camera and target"
        )
    dataset = check_plausible(dataset, robot.limits, robot.reach)
    rows = np.flatnonzero(dataset.included & dataset.in_session(dataset.sessions[0]))[:MAX_ROWS]
    if len(rows) >= MIN_ROWS:
        seen = dataset.take(rows)
        # effects are far smaller than what is refused
        poses = tool_poses(robot.with_effects(), Motion(seen.q))
        _refuse_lengths(seen, poses[:, :3, 3])
        _refuse_quaternions(seen, poses[:, :3, :3])
    return dataset


def _refuse_lengths(seen: Dataset, expected: Float[np.ndarray, "rows 3"]) -> None:
    """Raise where the tool moved a thousand times less or more than the arm did."""
    if seen.position is None or (there := ~np.isnan(seen.position).any(1)).sum() < MIN_ROWS:
        return
    measured, meant = (_extent(points[there]) for points in (seen.position, expected))
    if meant == 0.0 or measured == 0.0:
        return
    for factor, words in ((1e-3, "m labelled mm"), (1e3, "mm labelled m")):
        if 0.3 < measured / (factor * meant) < 3.0:
            raise DataError(
                f"{seen.source}: the tool moved {1e3 * measured:.3g} mm where the arm moved "
                f"{1e3 * meant:.3g} mm: these look like {words}; correct the headings"
            )


def _extent(points: Float[np.ndarray, "rows 3"]) -> float:
    """Usual distance from the middle [m]."""
    return float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))


def _refuse_quaternions(seen: Dataset, expected: Float[np.ndarray, "rows 3 3"]) -> None:
    """Raise where the quaternions fit the arm in another reading only.

    Up to the frames of base and tool, quaternions in the order x, y, z, w are those of the opposite turns.
    """
    if seen.rotation is None or not any("quaternion" in note for note in seen.notes):
        return
    there = ~np.isnan(seen.rotation).any((1, 2))
    if there.sum() < MIN_ROWS:
        return
    given, expected = seen.rotation[there], expected[there]
    off, left = _mismatch(given, expected), _mismatch(np.swapaxes(given, 1, 2), expected)
    if off > WRONG and left < RIGHT:
        raise DataError(
            f"{seen.source}: the turns differ by {np.degrees(off):.0f}° from the arm's, and by "
            f"{np.degrees(left):.1f}° if the quaternion has the order x, y, z, w or the opposite turn: name "
            "its columns qx, qy, qz, qw, or change the signs of qx, qy and qz"
        )


def _mismatch(measured: Float[np.ndarray, "rows 3 3"], expected: Float[np.ndarray, "rows 3 3"]) -> float:
    """How far the turns from the first row are from the arm's [rad], whatever base and tool are."""
    turned, meant = (turns @ turns[0].T for turns in (measured, expected))
    before, after = se3.matrix_to_rotvec(meant), se3.matrix_to_rotvec(turned)
    certain = (np.linalg.norm(before, axis=1) < ENDS) & (np.linalg.norm(after, axis=1) < ENDS)
    frame = nearest_rotation(after[certain].T @ before[certain])
    apart = se3.matrix_to_rotvec(np.swapaxes(turned, 1, 2) @ frame @ meant @ frame.T)
    return float(np.median(np.linalg.norm(apart, axis=1)))
