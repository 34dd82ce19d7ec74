"""Joint positions at random, anywhere within the limits or with the tool in a region."""

import numpy as np
from jaxtyping import Float

from workbench import se3
from workbench.design.region import Region
from workbench.errors import DataError
from workbench.model.forward import tool_poses
from workbench.robots.robot import Robot

TRIES = 400
"""A region that fewer than one in so many random tries reaches counts as out of reach."""
BLOCK = 2000
"""Random joint positions tried at a time."""


def in_base(robot: Robot, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the measuring frame seen from the robot's base, where regions and targets are given."""
    return se3.inverse(robot.base.pose) @ poses


def random_poses(
    robot: Robot, number: int, *, rng: np.random.Generator, region: Region | None = None
) -> Float[np.ndarray, "number n"]:
    """Joint positions spread evenly within the limits [rad or m], with the tool in the region if given.

    Raises:
        DataError: the tool practically never gets into the region.
    """
    low, high = robot.search_limits.T
    if region is None:
        return rng.uniform(low, high, (number, robot.dof))
    found = np.zeros((0, robot.dof))
    tries = 0
    while len(found) < number:
        q = rng.uniform(low, high, (BLOCK, robot.dof))
        inside = region.contains(in_base(robot, tool_poses(robot, q))[:, :3, 3])
        found = np.concatenate([found, q[inside]])
        tries += BLOCK
        if tries > 25 * TRIES * max(len(found), 1):
            raise DataError(
                f"robot '{robot.name}' hardly ever reaches the region {region.min.tolist()} to "
                f"{region.max.tolist()} m ({len(found)} of {tries} random joint positions); move the region"
            )
    return found[:number]
