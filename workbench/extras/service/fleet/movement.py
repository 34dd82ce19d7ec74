"""Changes between the calibrations of an arm: sudden or gradual, and their significance.

A constant's values x_t with standard errors σ_t are compared with three laws: x = c, a step
x = c + s [t ≥ t_k] for each t_k, and a line x = c + v t. Each is fitted by weighted least squares with a
misfit χ² = Σ (x − law)²/σ², and what a step or a line saves, √(χ²_c − χ²), is the number of σ by which the
constant moved: for two dates it is |x₂ − x₁| / √(σ₁² + σ₂²). Of step and line the one that saves more is
taken.

A calibration repeats itself less well than its own standard errors imply (the arm was set up anew, the model
lacks something). The differences of consecutive calibrations of all constants and arms, in σ, should have the
spread 1; by what factor their median magnitude has more, all σ are widened. A few worn arms don't move a
median. So many constants, dates and arms are looked at that chance alone brings some far out: a constant
moved if its σ are beyond what chance brings in one fleet of a hundred (Bonferroni).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from enum import StrEnum

import numpy as np
from jaxtyping import Float
from scipy import special

from workbench.extras.service.fleet.history import History

CHANCE = 0.01
"""Of a fleet in which nothing moved to show any movement."""
QUARTILE = 0.6745
"""Median magnitude of a standard normal number."""
MIN_DIFFERENCES = 20
"""Differences from which the factor is taken."""


class Law(StrEnum):
    """How a constant moved."""

    STEP = "step"
    DRIFT = "drift"


@dataclass(frozen=True, kw_only=True)
class Movement:
    """One constant that moved.

    Args:
        name: Of the constant.
        joint: Its joint, counted from 1; None for those of no joint.
        law: At once or little by little.
        shift: From the first calibration to the last, by the law, in SI.
        std: Standard error of the shift.
        sigmas: By how many σ the law is better than no movement.
        since: First calibration after a step; the first one of all for a drift.
        rate: Per day, of a drift; 0 for a step.
        tool: Root mean square displacement of the tool that the shift makes [m].
    """

    name: str
    joint: int | None
    law: Law
    shift: float
    std: float
    sigmas: float
    since: date
    rate: float
    tool: float = 0.0


def scatter_factor(histories: Sequence[History]) -> float:
    """How many times farther calibrations scatter than their standard errors imply; at least 1."""
    parts = [
        np.abs(np.diff(h.values, axis=0)) / np.hypot(h.std[1:], h.std[:-1])
        for h in histories
        if len(h.dates) > 1
    ]
    found = np.concatenate([part.ravel() for part in parts]) if parts else np.zeros(0)
    return max(1.0, float(np.median(found)) / QUARTILE) if len(found) >= MIN_DIFFERENCES else 1.0


def threshold(histories: Sequence[History]) -> float:
    """Number of σ beyond which a constant moved."""
    tried = sum(len(h.names) * max(len(h.dates) - 1, 0) for h in histories)
    return float(-special.ndtri(0.5 * CHANCE / max(tried, 1)))


def movements(history: History, *, factor: float, minimum: float) -> tuple[Movement, ...]:
    """Constants of an arm that moved, those by the most σ first.

    Args:
        factor: By which standard errors are widened.
        minimum: Number of σ from which a constant moved.
    """
    if len(history.dates) < 2:
        return ()
    found = [_movement(history, k, factor * history.std[:, k]) for k in range(len(history.names))]
    return tuple(sorted((m for m in found if m.sigmas > minimum), key=lambda m: -m.sigmas))


def _movement(history: History, k: int, sigma: Float[np.ndarray, " dates"]) -> Movement:
    """The better of step and line for one constant."""
    days, x, n = history.days, history.values[:, k], len(history.dates)
    laws = [(Law.STEP, first, (np.arange(n) >= first).astype(float)) for first in range(1, n)]
    if n > 2 and days[-1] > 0.0:
        laws.append((Law.DRIFT, 0, days / days[-1]))
    still = float((((x - np.average(x, weights=sigma**-2)) / sigma) ** 2).sum())
    best = None
    for law, first, shape in laws:
        design = np.column_stack([np.ones(n), shape]) / sigma[:, None]
        covariance = np.linalg.inv(design.T @ design)
        shift = float((covariance @ (design.T @ (x / sigma)))[1])
        saved = shift**2 / covariance[1, 1]
        if best is None or saved > best[0]:
            best = (saved, law, first, shift, float(np.sqrt(covariance[1, 1])))
    assert best is not None
    saved, law, first, shift, std = best
    name = history.names[k]
    head = name.partition(".")[0].removeprefix("joint")
    return Movement(
        name=name,
        joint=int(head) if head.isdigit() else None,
        law=law,
        shift=shift,
        std=std,
        sigmas=float(np.sqrt(min(saved, still))),
        since=history.dates[first],
        rate=shift / days[-1] if law is Law.DRIFT else 0.0,
    )
