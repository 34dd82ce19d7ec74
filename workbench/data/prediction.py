"""Predicted tool poses at measured rows, and errors axis by axis.

Every session of measurements may have its own base and tool, and what drives the arm's effects (payload,
temperature, direction of motion …) differs from row to row. Both are taken into account here and nowhere
else: errors, figures and the comparison in the page all use `predict`.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.kinematics.forward import watched_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.data.dataset import Dataset


def predict(robot: Robot, data: Dataset, *, link: int | None = None) -> Float[np.ndarray, "rows 4 4"]:
    """Poses that a model expects at measured rows, nothing fitted.

    Args:
        robot: The model; sessions have their own frames where it has them.
        data: Rows with joint positions and whatever drives the model's effects.
        link: Moving link, counted from 1, that is watched from a level frame; the tool in the measuring frame
            if None.
    """
    robot.check_joints(data.q, data.source)
    if not robot.sessions:
        return watched_poses(robot, Motion.of(data), link)
    poses, motion = np.empty((len(data), 4, 4)), Motion.of(data)
    for session in data.sessions:
        rows = data.in_session(session)
        poses[rows] = watched_poses(robot.in_session(session), motion.take(rows), link)
    return poses


@dataclass(frozen=True, eq=False)
class RowComponents:
    """Measured minus predicted, axis by axis, in the measuring frame.

    Args:
        position: Along x, y, z [m]; NaN in rows without a measured point.
        rotation: About x, y, z [rad]; NaN in rows without a measured orientation.
    """

    position: Float[np.ndarray, "rows 3"]
    rotation: Float[np.ndarray, "rows 3"]

    @property
    def has_position(self) -> Bool[np.ndarray, " rows"]:
        """Rows with a measured point."""
        return np.isfinite(self.position).all(-1)


def row_components(robot: Robot, data: Dataset) -> RowComponents:
    """Errors Δp_e, Δφ_e of a model on measured poses or points, nothing fitted.

    Rows that were observed in another way (markers, distances, contacts) have no such components: NaN.

    Source: ARIA eqs. (15), (16), with the angle in place of its sine.
    """
    predicted = predict(robot, data)
    missing = np.full((len(data), 3), np.nan)
    position = missing if data.position is None else data.position
    if data.rotation is None:
        return RowComponents(position - predicted[:, :3, 3], missing)
    error = se3.pose_error(se3.pose(data.rotation, position), predicted)
    return RowComponents(error[:, :3], error[:, 3:])
