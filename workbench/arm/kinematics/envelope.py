"""Reach of an arm at a given height, in any orientation: the outermost of many random postures."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3

POSTURES = 30_000
"""Number of random postures within the limits."""
DIRECTIONS = 48
"""Number of directions about the base's vertical axis."""
LAYERS = 40
"""Number of layers of height."""


def ring_at(robot: Robot, height: float) -> Float[np.ndarray, "places 3"]:
    """Outermost tool positions at a height above the base's frame [m], once round, or from gap to gap.

    Estimated from random postures: a few per cent inside the true boundary.
    """
    low, step, table = _outermost(robot)
    layer = int(np.floor((height - low) / step))
    if not 0 <= layer < LAYERS:
        return np.zeros((0, 3))
    radius = table[layer]
    known = np.flatnonzero(np.isfinite(radius))
    if not len(known):
        return np.zeros((0, 3))
    gaps = np.diff(np.append(known, known[0] + DIRECTIONS))
    begin = int(np.argmax(gaps)) + 1
    order = np.roll(known, -begin)
    if gaps.max() == 1:
        order = np.append(order, order[0])
    angle = 2.0 * np.pi * (order + 0.5) / DIRECTIONS - np.pi
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([radius[order, None] * circle, np.full(len(order), height)])


def maximum_reach(robot: Robot) -> float:
    """Maximum distance of the tool from the base's origin in any of these postures [m]."""
    return float(np.linalg.norm(_places(robot), axis=1).max())


@lru_cache(maxsize=4)
def _places(robot: Robot) -> Float[np.ndarray, "postures 3"]:
    """Tool positions in the base's frame."""
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (POSTURES, robot.dof))
    return se3.apply(se3.inverse(robot.base.pose), tool_poses(robot.with_effects(), Motion(q))[:, :3, 3])


@lru_cache(maxsize=4)
def _outermost(robot: Robot) -> tuple[float, float, Float[np.ndarray, "layers directions"]]:
    """Minimum height, height of a layer, maximum distance from the vertical axis by layer and direction."""
    places = _places(robot)
    bottom = float(places[:, 2].min())
    step = (float(places[:, 2].max()) - bottom) / LAYERS * (1.0 + 1e-9) or 1.0
    layer = ((places[:, 2] - bottom) / step).astype(int)
    turn = np.arctan2(places[:, 1], places[:, 0])
    direction = np.minimum((DIRECTIONS * (turn + np.pi) / (2.0 * np.pi)).astype(int), DIRECTIONS - 1)
    table = np.full((LAYERS, DIRECTIONS), -np.inf)
    np.maximum.at(table, (layer, direction), np.hypot(places[:, 0], places[:, 1]))
    return bottom, step, _smooth(np.where(np.isfinite(table), table, np.nan))


def _smooth(table: Float[np.ndarray, "layers directions"]) -> Float[np.ndarray, "layers directions"]:
    """Maximum distance per direction, averaged with its neighbours to smooth the random samples."""
    near = np.stack([np.roll(table, turn, axis=1) for turn in (-2, -1, 0, 1, 2)])
    maximum = np.fmax.reduce(near)
    near = np.stack([np.roll(maximum, turn, axis=1) for turn in (-2, -1, 0, 1, 2)])
    known = np.isfinite(near)
    mean = np.where(known, near, 0.0).sum(0) / np.maximum(known.sum(0), 1)
    return np.where(np.isfinite(table), mean, np.nan)
