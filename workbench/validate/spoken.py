"""Rows of which a model can speak: a joint's error is known only where it was learned."""

import numpy as np
from jaxtyping import Bool

from workbench.effects.local_joint_error import LocalJointError
from workbench.measure.dataset import Dataset
from workbench.robots.robot import Robot


def spoken_of(robot: Robot, data: Dataset) -> Bool[np.ndarray, " rows"]:
    """Rows within the ranges of the arm's local joint errors."""
    keep = np.ones(len(data), bool)
    for effect in robot.effects:
        if isinstance(effect, LocalJointError):
            q = data.q[:, effect.joints[0]]
            keep &= (q >= effect.limits[0]) & (q <= effect.limits[1])
    return keep
