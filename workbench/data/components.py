"""Errors of every row along the axes of the measuring frame: what the paper's 4 × 4 figures show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.data.dataset import Dataset


@dataclass(frozen=True, eq=False)
class RowComponents:
    """Measured minus predicted, axis by axis, in the measuring frame.

    Args:
        position: Along x, y, z [m]; NaN in rows without a measured point.
        rotation: About x, y, z [rad]; NaN in rows without a measured orientation.
    """

    position: Float[np.ndarray, "rows 3"]
    rotation: Float[np.ndarray, "rows 3"]

    def __len__(self) -> int:
        return len(self.position)

    @property
    def has_position(self) -> Bool[np.ndarray, " rows"]:
        """Rows with a measured point."""
        return np.isfinite(self.position).all(-1)

    @property
    def has_rotation(self) -> Bool[np.ndarray, " rows"]:
        """Rows with a measured orientation."""
        return np.isfinite(self.rotation).all(-1)


def row_components(robot: Robot, data: Dataset) -> RowComponents:
    """Errors Δp_e, Δφ_e of a model on measured poses or points, nothing fitted.

    Rows that were observed in another way (markers, distances, contacts) have no such components: NaN.

    Args:
        robot: The model; sessions have their own frames where it has them.
        data: Measured rows.

    Source: ARIA eqs. (15), (16).
    """
    robot.check_joints(data.q, data.source)
    predicted, whole = np.empty((len(data), 4, 4)), Motion.of(data)
    for session in data.sessions:
        rows = slice(None) if data.session is None else data.session == session
        frames = robot.session_frames(session)
        motion = whole.take(rows)
        arm = robot.with_frames(base=frames.base, tool=frames.tool)
        predicted[rows] = tool_poses(arm, motion.q, motion=motion)
    missing = np.full((len(data), 3), np.nan)
    position = missing if data.position is None else data.position
    if data.rotation is None:
        return RowComponents(position - predicted[:, :3, 3], missing)
    error = se3.pose_error_eq16(se3.pose(data.rotation, position), predicted)
    return RowComponents(error[:, :3], error[:, 3:])
