"""Skeleton of an arm: polylines of its links, and the frames that they move with.

The link after joint k follows the chain from that joint's axis to the next one, in any convention. Every link
moves with the frame right after its joint's driven element.
"""

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Freedom

MIN_LINK_PART = 1e-3
"""Minimum length of a link's segments [m]."""


def body_frames(
    robot: Robot, q: Float[np.ndarray, "rows n"], *, shift: Float[np.ndarray, "_ _"] = chains.NO_SHIFT
) -> Float[np.ndarray, "rows bodies 4 4"]:
    """Frames of the base and of the link after each joint, in the order of q, in the robot's base.

    Args:
        q: Joint positions [rad or m].
        shift: Increment of each element of its chain, row by row [rad or m]; none if empty.
    """
    after = np.concatenate([[robot.base_size - 1], robot.chain.driven])
    return se3.inverse(robot.base.pose) @ chains.frames(robot.chain, q, after, shift=shift)


def link_paths(robot: Robot) -> tuple[Float[np.ndarray, "points 3"], ...]:
    """Corner points of the base's post and of the link after each joint, each in its own frame [m].

    The last link of the chain ends at the tool's origin. A path of one point has no length.
    """
    starts = [robot.base_size - 1, *robot.chain.driven.tolist()]
    ends = [*(drive - 1 for drive in starts[1:]), len(robot.chain.elements) - 1]
    return tuple(_line(robot, start, end) for start, end in zip(starts, ends, strict=True))


def height_above_floor(robot: Robot) -> float:
    """Height of the arm's first frame above the floor of the measuring frame [m].

    Zero if the base is to be identified, is rotated, or can't be that of such an arm.
    """
    height = float(robot.base.xyz[2])
    is_upright = np.array_equal(robot.base.rotation, np.eye(3))
    is_stand = robot.base.free is Freedom.FIXED and is_upright and 0.0 < height < robot.reach
    return height if is_stand else 0.0


def _line(robot: Robot, first: int, last: int) -> Float[np.ndarray, "points 3"]:
    """Origins of the frames after the elements first … last, seen from the first."""
    after = np.arange(first, max(last, first) + 1)
    frames = chains.frames(robot.chain, np.zeros((1, robot.dof)), after)[0]
    points = se3.apply(se3.inverse(frames[0]), frames[:, :3, 3])
    kept = [points[0]]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) > MIN_LINK_PART:
            kept.append(point)
    return np.array(kept)
