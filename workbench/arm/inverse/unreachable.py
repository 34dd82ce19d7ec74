"""The posture nearest to a target within the limits, and why none reaches it, in one sentence.

The nearest posture minimises |p* − p|² + w² |ρ|² from many starts (`damped_newton`), with w so small that the
position comes first: if the position alone can be met from there, it is the orientation that can't be.
"""

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import margins
from workbench.arm.inverse.damped_newton import Reached, Task, refine
from workbench.arm.inverse.reduced_arm import ReducedArm
from workbench.arm.inverse.solutions import random_starts
from workbench.base.wording import in_mm

NEAREST_STARTS = 96
"""Random starts of a search for the nearest posture."""
POSITION_FIRST = 2e-3
"""Weight w that gives priority to the position, as a share of the arm's length."""


def nearest(
    arm: ReducedArm,
    target: Float[np.ndarray, "4 4"],
    starts: Float[np.ndarray, "rows n"],
    *,
    task: Task,
    limits: Float[np.ndarray, "n 2"],
    rng: np.random.Generator,
) -> Reached:
    """The nearest posture within the limits.

    Args:
        starts: Postures to start from beside random ones, such as solutions outside the limits.
    """
    weight = POSITION_FIRST * arm.length
    starts = np.concatenate([starts, random_starts(arm, (NEAREST_STARTS,), rng, limits=limits)])
    found = refine(arm, target[None], starts, task=task, limits=limits, weight=weight, iterations=200)
    return found.row(int(np.argmin(found.cost(weight))))


def limits_reason(
    q: Float[np.ndarray, "rows n"], limits: Float[np.ndarray, "n 2"], slides: Float[np.ndarray, " n"]
) -> str:
    """The limits that exclude the existing solutions: those with the smallest violation.

    Args:
        q: Solutions outside the limits, at their best turn.
    """
    beyond = np.minimum(margins(q, limits), 0.0)
    best = int(np.argmax(beyond.sum(1)))
    parts = []
    for k in np.flatnonzero(beyond[best]).tolist():
        unit, value = "m" if slides[k] else "rad", q[best, k]
        limit = limits[k, 0] if value < limits[k, 0] else limits[k, 1]
        digits = 2 if abs(value - limit) >= 0.01 else 4
        parts.append(f"joint {k + 1} (needs {value:.{digits}f} {unit}, limit {limit:.{digits}f} {unit})")
    sentence = f"reachable only outside the limits of {' and '.join(parts)}"
    return sentence if len(q) == 1 else f"{sentence}, the closest of {len(q)} solutions"


def geometry_reason(
    arm: ReducedArm, target: Float[np.ndarray, "4 4"], found: Reached, limits: Float[np.ndarray, "n 2"]
) -> str:
    """Why no joint positions reach a target of which this is the nearest posture."""
    there = refine(arm, target[None], found.q[None], task=Task.POSITION, limits=limits).row(0)
    if not there.converged:
        return f"the target is {in_mm(float(there.position_error))} out of the arm's reach"
    off = f"the nearest is about {np.degrees(found.rotation_error):.2g}° off"
    return f"the position is reachable, but not in this orientation: {off}"
