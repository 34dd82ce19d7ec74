"""Trajectories made: a curve planned for an arm, its loads, and its file: what `workbench path` runs."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Frame, JointKind, Robot
from workbench.arm.statics.moments import JointMoments, joint_moments
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset
from workbench.data.readers import read_trajectory
from workbench.data.writer import write_measurements
from workbench.paths.curves import Circle, circle_through
from workbench.paths.planning import Planned


def planned_moments(planned: Planned) -> JointMoments | None:
    """Torques, and moments across the axes, along a trajectory; None where the arm has no masses."""
    return joint_moments(planned.robot, planned.motion) if planned.robot.has_masses else None


def taught_circle(robot: Robot, q: Float[np.ndarray, "points n"]) -> Circle:
    """The circle through the points that a controller believes to be at where it was led by hand (§5.5.2).

    Args:
        robot: The arm as its controller computes it.
        q: Joint positions at three points of the circle or more [rad or m].
    """
    believed = robot.with_effects().with_frames(base=Frame())
    return circle_through(tool_poses(believed, Motion(q))[:, :3, 3])


def read_taught(path: Path, robot: Robot) -> Float[np.ndarray, "points n"]:
    """Joint positions of taught points.

    Raises:
        DataError: the file has no joints.
    """
    q = read_trajectory(path, joints=robot.dof).q
    if q is None:
        raise DataError(f"{path}: taught points need joints (q1[rad] …)")
    return q


def write_plan(planned: Planned, path: Path | str) -> Path:
    """Write a trajectory as a table with units: time, joints, and the poses that they mean."""
    rows = Dataset(
        q=planned.q,
        row=np.arange(len(planned.q)),
        position=planned.poses[:, :3, 3],
        rotation=planned.poses[:, :3, :3],
        time=planned.time,
    )
    sliding = [i for i, j in enumerate(planned.robot.moving) if j.kind is JointKind.PRISMATIC]
    return write_measurements(rows, path, prismatic=sliding)
