"""Reach of an arm in any orientation: the outermost of many random postures."""

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3

POSTURES = 30_000
"""Number of random postures within the limits."""


def maximum_reach(robot: Robot) -> float:
    """Maximum distance of the tool from the base's origin in any of these postures [m]."""
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (POSTURES, robot.dof))
    places = se3.apply(se3.inverse(robot.base.pose), tool_poses(robot.with_effects(), Motion(q))[:, :3, 3])
    return float(np.linalg.norm(places, axis=1).max())
