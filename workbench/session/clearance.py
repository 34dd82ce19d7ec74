"""Whether an arm keeps clear of the plate and its blocks: a quick look at its axis lines, not a full check.

The lines between neighbouring link frames are sampled; the last one, which carries the probe to the target,
is left out. A sample is too close when it lies over the plate's solid, or over a block, and lower than the
arm is thick.
"""

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.plate.plate import Plate

THICKNESS = 0.03
"""Radius of an arm, as a share of its reach."""
BLOCK = 0.026
"""Half the width of a target's block at its foot [m]."""
SAMPLES = 8
"""Points looked at on each line."""


def is_clear(robot: Robot, plate: Plate, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
    """Which postures keep the arm above plate and blocks, wherever it is over them; all without a solid."""
    if plate.size is None:
        return np.ones(len(q), bool)
    points, radius = _points(robot, plate, q), THICKNESS * robot.reach
    return ~(_in_plate(plate, points, radius) | _in_blocks(plate, points, radius).any(-1)).any((1, 2))


def first_hit(robot: Robot, plate: Plate, q: Float[np.ndarray, " n"]) -> str:
    """What the arm would run into, and with which link, in words; empty if it keeps clear."""
    if plate.size is None:
        return ""
    points, radius = _points(robot, plate, q[None])[0], THICKNESS * robot.reach
    if (links := _in_plate(plate, points, radius).any(1)).any():
        return f"link {int(links.argmax()) + 2} would run into the plate"
    blocks = _in_blocks(plate, points, radius).any(1)
    if blocks.any():
        link, block = np.argwhere(blocks)[0]
        return f"link {link + 2} would run into the block of target {block + 1}"
    return ""


def _points(robot: Robot, plate: Plate, q: np.ndarray) -> Float[np.ndarray, "rows links samples 3"]:
    """Points along the arm, in the plate's frame."""
    places = se3.inverse(robot.base.pose @ plate.pose) @ link_frames(robot, Motion(q))[:, :-1]
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    start, end = places[:, :-2, None, :3, 3], places[:, 1:-1, None, :3, 3]
    return start + share * (end - start)


def _in_plate(plate: Plate, points: Float[np.ndarray, "*lead 3"], radius: float) -> Bool[np.ndarray, "*lead"]:
    assert plate.size is not None
    over = (np.abs(points[..., :2]) < 0.5 * plate.size[:2] + radius).all(-1)
    return over & (points[..., 2] < radius)


def _in_blocks(plate: Plate, points: Float[np.ndarray, "*lead 3"], radius: float):
    """Which points are inside which block, last axis: a cylinder from the plate to each target."""
    places = se3.apply(se3.inverse(plate.pose), plate.poses[:, :3, 3])
    apart = np.linalg.norm(points[..., None, :2] - places[:, :2], axis=-1)
    return (apart < BLOCK + 0.5 * radius) & (points[..., None, 2] < places[:, 2] + 0.5 * radius)
