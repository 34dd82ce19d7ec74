"""Rows within the range of a model: some effects are known only where they were learned."""

import numpy as np
from jaxtyping import Bool

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset


def in_known_range(robot: Robot, data: Dataset) -> Bool[np.ndarray, " rows"]:
    """Rows within the joint ranges of all effects of the arm."""
    keep = np.ones(len(data), bool)
    for effect in robot.effects:
        for joint, (low, high) in effect.ranges().items():
            keep &= (data.q[:, joint] >= low) & (data.q[:, joint] <= high)
    return keep
