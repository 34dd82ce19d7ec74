"""Whether an arm keeps clear of the plate: a quick look at its axis lines, not a full collision check.

The lines between neighbouring link frames are sampled; the last one, which carries the probe to the target,
is left out. A sample is too close when it lies over the plate's solid and lower than the arm is thick.
"""

import numpy as np
from jaxtyping import Bool, Float

from workbench import se3
from workbench.design.plate import Plate
from workbench.model.forward import link_frames
from workbench.robots.robot import Robot

THICKNESS = 0.03
"""Radius of an arm, as a share of its reach."""
SAMPLES = 8
"""Points looked at on each line."""


def is_clear(robot: Robot, plate: Plate, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
    """Which postures keep the arm above the plate, wherever it is over it; all if the plate has no solid."""
    if plate.size is None:
        return np.ones(len(q), bool)
    radius = THICKNESS * robot.reach
    places = se3.inverse(robot.base.pose @ plate.pose) @ link_frames(robot, q)[:, :-1]
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    start, end = places[:, :-2, None, :3, 3], places[:, 1:-1, None, :3, 3]
    points = start + share * (end - start)
    over = (np.abs(points[..., :2]) < 0.5 * plate.size[:2] + radius).all(-1)
    return ~(over & (points[..., 2] < radius)).any((1, 2))
