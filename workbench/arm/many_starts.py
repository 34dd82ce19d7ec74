"""Levenberg–Marquardt from many starts at once."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

MAX_STEP = 0.5
"""Longest step of any unknown [rad or m]."""
MIN_DECREASE = 1e-9
"""Minimum relative decrease of a start's cost to continue."""
MIN_DAMPING = 1e-12
"""Damping, relative to the mean square column."""
State = tuple[np.ndarray, ...]


def descend(
    state: State,
    linearise: Callable[..., tuple[np.ndarray, np.ndarray]],
    moved: Callable[..., State],
    *,
    steps: int = 60,
) -> tuple[State, Float[np.ndarray, "starts numbers"]]:
    """Least squares by damped Gauss–Newton steps.

    Args:
        state: The starts, each array with one entry a start.
        linearise: Weighed errors, measured minus predicted (starts, numbers), and the derivatives of the
            prediction (starts, numbers, p).
        moved: A state after a step (starts, p).
        steps: Maximum number.

    Returns:
        Final states and their remaining errors.
    """
    state = tuple(part.copy() for part in state)
    error, jacobian = linearise(*state)
    cost, damping = (error**2).sum(1), np.full(len(error), 1e-3)
    for _ in range(steps):
        normal = jacobian.swapaxes(1, 2) @ jacobian
        usual = normal.trace(axis1=1, axis2=2) / normal.shape[-1]
        normal += (damping * usual)[:, None, None] * np.eye(normal.shape[-1])
        step = np.linalg.solve(normal, jacobian.swapaxes(1, 2) @ error[..., None])[..., 0]
        step *= np.minimum(1.0, MAX_STEP / np.maximum(np.abs(step).max(1), 1e-300))[:, None]
        tried = moved(*state, step)
        new_error, new_jacobian = linearise(*tried)
        new = (new_error**2).sum(1)
        better = new < cost
        goes_on = bool((cost - new > MIN_DECREASE * cost).any()) or damping.min() < 1.0
        now = (*state, error, jacobian, cost)
        for old, other in zip(now, (*tried, new_error, new_jacobian, new), strict=True):
            old[better] = other[better]
        damping = np.where(better, np.maximum(0.1 * damping, MIN_DAMPING), 10.0 * damping)
        if not goes_on:
            break
    return state, error
