"""What a probe's tip touches: balls and planes at fixed places, and how the arm comes to touch them.

A ball is touched all around, which gives its centre in the tool's frame: as good as a contact of the tool
point with that centre. A plane is touched the shortest way from where the tip is, off by the probe's noise
along its normal. Both are done in the posture next to the one that the arm had.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.solve import Task
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Vector3

FLOOR, WALLS = 0.1, 0.45
"""Height of the touched floor over the base, and distance of the touched walls from it, as shares of the
reach, where no planes are given."""


class PlaneSurface(NamedTuple):
    """A plane n·p = d in the measuring frame.

    Args:
        normal: Unit normal n.
        offset: d [m].
    """

    normal: Vector3
    offset: float


class Touched(NamedTuple):
    """How the arm touches surfaces.

    Args:
        q: Joint positions in contact [rad or m]; where it can't be reached, as they were.
        names: Surface of each row.
        reached: Whether the contact was made.
    """

    q: Float[np.ndarray, "rows n"]
    names: np.ndarray
    reached: Bool[np.ndarray, " rows"]


def three_planes(robot: Robot) -> dict[str, PlaneSurface]:
    """A floor and two walls about the base, named `plane floor`, `plane side` and `plane front`."""
    rotation, origin = robot.base.rotation, robot.base.xyz
    distances = robot.reach * np.array([WALLS, WALLS, FLOOR])
    names = ("plane front", "plane side", "plane floor")
    return {
        name: PlaneSurface(rotation[:, i], float(rotation[:, i] @ origin + distances[i]))
        for i, name in enumerate(names)
    }


def touch_balls(
    actual: Robot,
    motion: Motion,
    balls: Mapping[str, Vector3],
    *,
    sigma: float,
    rng: np.random.Generator,
) -> Touched:
    """Find the centres of balls in turn by touching them all around.

    Args:
        actual: The arm.
        motion: Joint positions from which it comes, and what drives the arm's effects.
        balls: Centres by name [m].
        sigma: Standard deviation of a centre's coordinate [m].
        rng: Source of the noise.
    """
    names = np.array(list(balls))[np.arange(len(motion)) % len(balls)]
    centres = np.stack([balls[name] for name in names])
    return _bring(actual, motion, centres + rng.normal(0.0, sigma, centres.shape), names)


def touch_planes(
    actual: Robot,
    motion: Motion,
    planes: Mapping[str, PlaneSurface],
    *,
    sigma: float,
    rng: np.random.Generator,
) -> Touched:
    """Touch planes in turn from the given joint positions; arguments as `touch_balls`."""
    names = np.array(list(planes))[np.arange(len(motion)) % len(planes)]
    normals = np.stack([planes[name].normal for name in names])
    offsets = np.array([planes[name].offset for name in names]) + rng.normal(0.0, sigma, len(motion))
    tips = tool_poses(actual, motion)[:, :3, 3]
    gaps = offsets - (normals * tips).sum(axis=1)
    return _bring(actual, motion, tips + gaps[:, None] * normals, names)


def _bring(actual: Robot, motion: Motion, tips: Float[np.ndarray, "rows 3"], names: np.ndarray) -> Touched:
    """The joint positions next to q whose tip is at each place."""
    q = motion.q
    targets = se3.pose(tool_poses(actual, motion)[:, :3, :3], tips)
    found = inverse.follow_many(actual, targets, q, task=Task.POSITION, motion=motion)
    return Touched(np.where(found.converged[:, None], found.q, q), names, found.converged)
