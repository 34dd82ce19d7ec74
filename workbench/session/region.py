"""The poses of a region for which errors are predicted."""

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.damped_newton import Task
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.types import frozen
from workbench.plate.poses.sampling import random_poses
from workbench.plate.region import Region
from workbench.plate.region_poses import region_poses

REGION_POSES = 24
"""Places in the region, in all branches of each, for which the error is predicted."""
RANDOM_POSES = 150
"""Random postures with the tool in the region instead, for arms that few random poses suit."""


def draw_region(robot: Robot, region: Region, rng: np.random.Generator) -> Float[np.ndarray, "poses n"]:
    """Poses that matter: any place in the region, any orientation, any branch; none if out of reach."""
    try:
        if robot.dof < int(Task.POSE):
            return frozen(random_poses(robot, RANDOM_POSES, rng=rng, region=region))
        return frozen(region_poses(robot, region, REGION_POSES, rng=rng))
    except DataError:
        return frozen(np.zeros((0, robot.dof)))
