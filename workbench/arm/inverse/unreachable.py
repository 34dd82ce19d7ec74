"""Why a target can't be reached, in one sentence, and the nearest configuration.

The nearest configuration minimises |p* − p|² + w² |ρ|² within the limits from many starts (`damped_newton`).
Reasons are tested in this order: limits; position; orientation at the position.
"""

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import (
    POSITION_TOLERANCE,
    ROTATION_WEIGHT,
    Refined,
    Task,
    refine,
    unlimited,
)
from workbench.arm.inverse.reduced_arm import ReducedArm
from workbench.arm.inverse.solutions import random_starts
from workbench.base.wording import in_mm

NEAREST_STARTS = 96
"""Random starts of each search for a nearest configuration."""
LIGHT = 2e-3
"""Weight w that gives priority to the position, as a share of the arm's length."""
SAME_ANGLE = 1e-4
"""Orientation that is met [rad]."""


def nearest(
    arm: ReducedArm,
    target: Float[np.ndarray, "4 4"],
    *,
    task: Task,
    limits: Float[np.ndarray, "n 2"],
    rng: np.random.Generator,
    starts: Float[np.ndarray, "rows n"] | None = None,
    weight: float | None = None,
) -> Refined:
    """The nearest configuration within the limits, as one row.

    Args:
        task: Which part of it must be met.
        limits: In the chain's order.
        rng: For the random starts.
        starts: Further starts in the chain's order, such as solutions outside the limits.
        weight: w of the objective [m/rad].
    """
    rows = random_starts(arm, (NEAREST_STARTS,), rng, limits=limits)
    if starts is not None:
        rows = np.concatenate([starts, rows])
    one = np.zeros(len(rows), np.int64)
    result = refine(
        arm, target[None], rows, task=task, target_of=one, limits=limits, weight=weight, iterations=200
    )
    i = int(np.argmin(result.cost(ROTATION_WEIGHT * arm.length if weight is None else weight)))
    return Refined(*(part[i : i + 1] for part in vars(result).values()))


def limits_reason(arm: ReducedArm, x: Float[np.ndarray, "rows n"], limits: Float[np.ndarray, "n 2"]) -> str:
    """The limits that exclude the existing solutions: those with the smallest violation.

    Args:
        x: Solutions outside the limits, in the chain's order, at their best turn.
        limits: In the chain's order.
    """
    beyond = np.minimum(margins(x, limits), 0.0)
    best = int(np.argmax(beyond.sum(1)))
    parts = []
    for column in range(arm.dof):
        k = int(arm.places[column])
        if beyond[best, k] < 0.0:
            unit = "m" if arm.slides[k] else "rad"
            limit = limits[k, 0] if x[best, k] < limits[k, 0] else limits[k, 1]
            value = x[best, k]
            digits = 2 if abs(value - limit) >= 0.01 else 4
            parts.append(
                f"joint {column + 1} (needs {value:.{digits}f} {unit}, limit {limit:.{digits}f} {unit})"
            )
    sentence = f"reachable only outside the limits of {' and '.join(parts)}"
    return sentence if len(x) == 1 else f"{sentence}, the closest of {len(x)} solutions"


def geometry_reason(
    arm: ReducedArm,
    target: Float[np.ndarray, "4 4"],
    *,
    task: Task,
    limits: Float[np.ndarray, "n 2"],
    rng: np.random.Generator,
) -> str:
    """Why no joint coordinates at all, or for a redundant arm none within the limits, reach the target."""
    free = np.where(arm.slides[:, None], limits, unlimited(arm.dof))
    closest = nearest(arm, target, task=Task.POSITION, limits=free, rng=rng)
    if (gap := float(closest.position_error[0])) > POSITION_TOLERANCE:
        return f"the target is {in_mm(gap)} out of the arm's reach"
    turned = nearest(arm, target, task=task, limits=free, rng=rng, weight=LIGHT * arm.length)
    angle = float(turned.rotation_error[0])
    if task is Task.POSITION or angle < SAME_ANGLE:
        return "reachable only outside the joint limits"
    off = f"the nearest is about {np.degrees(angle):.2g}° off"
    return f"the position is reachable, but not in this orientation: {off}"
