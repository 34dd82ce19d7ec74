"""OPT1: the scalar cost of ARIA eq. (19) minimised within bounds, the counterpart of `fmincon`.

The method sees only the sum of squares, its gradient and every parameter's interval:
sequential quadratic programming with an active set and a BFGS Hessian (SLSQP), in parameters scaled by
the lengths of the Jacobian's columns at the start. Bounds come with the parameters.

Source: Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28 (1988).
"""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float
from scipy.optimize import Bounds, minimize

from workbench.base.progress import Cancelled, check_cancelled
from workbench.base.types import Outcome
from workbench.identification.algorithms.identifier import AbstractIdentifier, SearchOutcome, ended
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import factorise

ROUNDING = 1e-15
"""Minimum change of the scalar cost, relative to the start's; smaller ones are rounding."""
SAME_COST = 1e-6
"""Relative difference below which two costs count as equal."""


@final
@dataclass(frozen=True)
class Opt1(AbstractIdentifier):
    """Bounded minimisation of the scalar cost.

    Args:
        limit: Maximum number of iterations.
    """

    limit: int = 2000
    name = "opt1"
    title = "OPT1"
    summary = "Bounded minimisation of the summed squares: keeps every parameter near its nominal value."

    def search(self, problem: Problem) -> SearchOutcome:
        start = problem.start
        columns = np.linalg.norm(problem.jacobian(start), axis=0)
        scale = 1.0 / np.where(columns > 1e-9 * columns.max(initial=0.0), columns, 1.0)
        lower, upper = problem.bounds
        history: list[float] = []
        minimum, best = np.inf, start.copy()

        def cost(y: np.ndarray) -> tuple[float, np.ndarray]:
            nonlocal minimum, best
            x = start + scale * y
            value, gradient = problem.cost_and_gradient(x)
            if value < minimum:
                minimum, best = value, x
            if not history:
                history.append(value)
            return value, scale * gradient

        def after_iteration(_: np.ndarray) -> None:
            history.append(minimum)
            check_cancelled()

        first, _ = cost(np.zeros(len(start)))
        if not np.isfinite(first):
            return SearchOutcome(start.copy(), Outcome.DIVERGED, (first,))
        try:
            answer = minimize(
                cost,
                np.zeros(len(start)),
                jac=True,
                method="SLSQP",
                bounds=Bounds((lower - start) / scale, (upper - start) / scale),
                callback=after_iteration,
                options={"ftol": max(ROUNDING * first * 1e-7, 1e-22), "maxiter": self.limit},
            )
        except Cancelled:
            return SearchOutcome(best, Outcome.CANCELLED, tuple(history))
        x = _near_nominal(problem, np.clip(best, lower, upper))
        if answer.success:
            outcome = Outcome.CONVERGED
        elif answer.nit >= self.limit:
            outcome = Outcome.ITERATION_LIMIT
        else:
            at = problem.evaluate(x)
            factor = factorise(at.jacobian, at.residual, problem.units)
            outcome = ended(factor.predicted_decrease(), [*history, minimum], problem.count)
        return SearchOutcome(x, outcome, tuple(history))


def _near_nominal(problem: Problem, x: Float[np.ndarray, " p"]) -> Float[np.ndarray, " p"]:
    """The answer without its null-space part, along which the scalar cost lets it drift."""
    at = problem.evaluate(x)
    factor = factorise(at.jacobian, at.residual, problem.units)
    open_ones = np.column_stack([factor.null_space, factor.weak])
    lower, upper = problem.bounds
    for directions in (open_ones, factor.null_space):
        moved = x - factor.units * (directions @ (directions.T @ ((x - problem.start) / factor.units)))
        residual = problem.residual(moved)
        square = float(at.residual @ at.residual)
        chance = min(1.0, square / max(problem.count, 1))
        costs_nothing = residual @ residual <= square * (1.0 + SAME_COST) + chance
        if costs_nothing and np.all((lower <= moved) & (moved <= upper)):
            return moved
    return x
