"""The interface of an identification algorithm, and its result.

An algorithm takes a `Problem` and searches from its start. What is computed at the answer (covariance,
rank, row residuals) is the same for all algorithms and is implemented in `identification/fit.py`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from workbench.base.progress import cancelled
from workbench.base.types import Outcome
from workbench.identification.problem import LinearisedProblem, Problem
from workbench.identification.undetermined_combinations import Factor, factorise, factorise_products

STEP_TOLERANCE = 1e-4
"""The search ends when the predicted step is below this many standard errors."""
NOISE_FLOOR = 0.1
"""Without a step downhill, a predicted step below this many standard errors means that the search is at the
noise floor: the data can't tell its answer from the optimum."""
HALVINGS = 12
"""How often a step may be halved."""
ROUNDING = 1e-8
"""Relative decrease that is rounding error once no step reduces the cost any further."""
RESIDUAL_FLOOR = 1e-10
"""… or a change of the residuals by less than this many stated standard deviations: rounding error."""


@dataclass(frozen=True, eq=False)
class SearchOutcome:
    """How a search went.

    Args:
        x: Best unknowns found [rad or m].
        history: Cost ½|r|² after every iteration, the start's first.
        factor: Factorisation at x, if the search ended with one.
    """

    x: Float[np.ndarray, " p"]
    outcome: Outcome
    history: tuple[float, ...]
    factor: Factor | None = None


@dataclass(frozen=True)
class AbstractIdentifier(ABC):
    """One algorithm. Final subclasses hold its settings."""

    name: ClassVar[str]
    """As in files and commands."""
    title: ClassVar[str]
    """As in tables and figures."""
    summary: ClassVar[str]
    """Description in one sentence, to help users choose."""

    @abstractmethod
    def search(self, problem: Problem, *, begin: Float[np.ndarray, " p"] | None = None) -> SearchOutcome:
        """Minimise the problem's cost; `cancelled()` is polled between steps.

        Args:
            begin: Unknowns near the minimum, if known; an algorithm whose answer depends on its path begins
                at the problem's start anyway.
        """


Begin = Float[np.ndarray, " p"] | None
Step = Callable[
    [np.ndarray, LinearisedProblem, Factor, float],
    tuple[np.ndarray, float, LinearisedProblem] | Outcome | None,
]
"""(x, residuals, factor, cost) → (x, cost, residuals) after a step downhill; None if there is none; or the
outcome with which the search ends."""


def descend(
    problem: Problem, step: Step, *, limit: int = 100, begin: Begin = None, tolerance: float = STEP_TOLERANCE
) -> SearchOutcome:
    """Take at most so many steps, from the problem's start or a given x, until the next one would be below
    so many standard errors."""
    x = (problem.start if begin is None else begin).copy()
    at = problem.evaluate(x)
    history = [0.5 * float(at.residual @ at.residual)]
    for _ in range(limit):
        if not (is_finite := np.isfinite(history[-1])) or cancelled():
            why = Outcome.CANCELLED if is_finite else Outcome.DIVERGED
            return SearchOutcome(x, why, tuple(history))
        factor = factor_of(problem, at)
        if has_converged(factor, factor.predicted_decrease(), problem.count, tolerance):
            return SearchOutcome(x, Outcome.CONVERGED, tuple(history), factor)
        found = step(x, at, factor, history[-1])
        if found is None:
            found = ended(factor.predicted_decrease(), history, problem.count)
        if isinstance(found, Outcome):
            return SearchOutcome(x, found, tuple(history), factor)
        x, cost, at = found
        history.append(cost)
    return SearchOutcome(x, Outcome.ITERATION_LIMIT, tuple(history))


def downhill(
    problem: Problem, x: Float[np.ndarray, " p"], step: Float[np.ndarray, " p"], cost: float
) -> tuple[np.ndarray, float, LinearisedProblem] | None:
    """What follows a step, halved until the cost decreases; None if it doesn't."""
    for _ in range(HALVINGS):
        trial = problem.evaluate(x + step)
        if (less := 0.5 * float(trial.residual @ trial.residual)) < cost:
            return x + step, less, trial
        step = step / 2
    return None


def factor_of(problem: Problem, at: LinearisedProblem) -> Factor:
    """Factorisation of a linearised problem; of the normal equations if a prior on constants makes all
    directions identifiable."""
    if problem.deviation is not None:
        table = np.column_stack([at.jacobian, at.residual])
        found = factorise_products(table.T @ table, problem.units)
        if found is not None and found.inverse is not None:
            return found
    return factorise([(at.residual, at.jacobian)], problem.units)


def has_converged(factor: Factor, decrease: float, size: int, tolerance: float = STEP_TOLERANCE) -> bool:
    """Whether the predicted decrease of |r|² is negligible against the noise.

    A step of s standard errors predicts a decrease of s² times the residual variance.
    """
    variance = factor.residual_square / max(size - factor.rank, 1)
    return decrease <= max(tolerance**2 * variance, RESIDUAL_FLOOR**2 * size)


def ended(promised: float, history: list[float], size: int) -> Outcome:
    """Outcome of a search that found no step downhill: converged to noise or rounding, or stuck above it.

    Args:
        promised: Decrease of |r|² that the linear model still promises.
        history: Cost ½|r|² so far.
        size: Number of measured components.
    """
    residual_square = 2.0 * history[-1]
    floor = max(NOISE_FLOOR**2 * residual_square / max(size, 1), ROUNDING * residual_square)
    at_bottom = promised <= floor or history[-1] <= ROUNDING**2 * history[0]
    return Outcome.CONVERGED if at_bottom else Outcome.STALLED


def gauge_step(
    factor: Factor, step: Float[np.ndarray, " p"], from_nominal: Float[np.ndarray, " p"]
) -> Float[np.ndarray, " p"]:
    """The step, shifted within the null space so that the parameters end as near to nominal as possible."""
    if factor.inverse is not None:
        return step
    n = factor.null_space
    return step - factor.units * (n @ (n.T @ ((from_nominal + step) / factor.units)))
