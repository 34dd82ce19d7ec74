"""The nominal arm, and bodies to draw of any."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.views.appearance.bodies import Body, body_frames, make_bodies
from workbench.views.drawables.drawable import Arm
from workbench.views.drawables.sink import Item


def nominal_arm_at(robot: Robot, q: Float[np.ndarray, " n"]) -> Item:
    """The arm in its own colours at joint positions [rad or m]."""
    return Item("arm/nominal", nominal_arm, (robot, q))


@lru_cache(maxsize=16)
def bodies_of(
    robot: Robot, *, swell: float = 1.0, is_plain: bool = False, has_foot: bool = True
) -> tuple[Body, ...]:
    """Bodies to draw, also of an arm with meshes from its geometry alone (`is_plain`), or without a foot."""
    foot, *others = make_bodies(robot, swell=swell, is_plain=is_plain)
    return (foot if has_foot else Body(()), *others)


def nominal_arm(robot: Robot, q: Float[np.ndarray, " n"]) -> Arm:
    return Arm(bodies=bodies_of(robot), frames=body_frames(robot, q))
