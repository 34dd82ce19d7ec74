"""Random joint positions, within the limits or with the tool in a region."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.plate.region import Region

TRIES = 400
"""Number of random tries per hit above which a region counts as out of reach."""
BLOCK = 2000
"""Random joint positions tried at a time."""


def in_base(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 4 4"]:
    """Poses of the tool seen from the robot's base, where regions and targets are given."""
    return se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(q))


def random_poses(
    robot: Robot, number: int, *, rng: np.random.Generator, region: Region | None = None
) -> Float[np.ndarray, "number n"]:
    """Joint positions spread evenly within the limits [rad or m], with the tool in the region if given."""
    if region is None:
        low, high = robot.search_limits.T
        return rng.uniform(low, high, (number, robot.dof))

    def complaint(found: int, tries: int) -> str:
        return (
            f"robot '{robot.name}' rarely reaches the region {region.min.tolist()} to "
            f"{region.max.tolist()} m ({found} of {tries} random joint positions); move the region"
        )

    def inside(q: np.ndarray) -> np.ndarray:
        return region.contains(in_base(robot, q)[:, :3, 3])

    return poses_satisfying(robot, number, inside, rng=rng, complaint=complaint)


def poses_satisfying(
    robot: Robot,
    number: int,
    keep: Callable[[np.ndarray], np.ndarray],
    *,
    rng: np.random.Generator,
    complaint: Callable[[int, int], str],
) -> Float[np.ndarray, "number n"]:
    """Random joint positions within the limits that are kept [rad or m].

    Args:
        keep: Which of a stack of joint positions are kept.
        complaint: Message if practically none is kept, from the number kept and tried.
    """
    low, high = robot.search_limits.T
    found = np.zeros((0, robot.dof))
    tries = 0
    while len(found) < number:
        q = rng.uniform(low, high, (BLOCK, robot.dof))
        found = np.concatenate([found, q[keep(q)]])
        tries += BLOCK
        if tries > 25 * TRIES * max(len(found), 1):
            raise DataError(complaint(len(found), tries))
    return found[:number]
