"""OPT1: the scalar cost of ARIA eq. (19) minimised within bounds, the counterpart of `fmincon`.

The method sees only the sum of squares, its gradient and every parameter's interval:
sequential quadratic programming with an active set and a BFGS Hessian (SLSQP), in parameters scaled by
the lengths of the Jacobian's columns. Bounds come with the parameters. The search starts from the answer of
OLS, moved to the nearest bounds: along unobservable combinations it stays as near to nominal as that.

Source: Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28 (1988).
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.base.progress import Cancelled, check_cancelled
from workbench.base.types import Outcome
from workbench.identification.algorithms.identifier import AbstractIdentifier, SearchOutcome, ended, factor_of
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem

ROUNDING = 1e-15
"""Minimum change of the scalar cost, relative to the first one; smaller ones are rounding."""


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
        from scipy.optimize import Bounds, minimize

        free, (lower, upper) = Ols().search(problem), problem.bounds
        if free.outcome in (Outcome.DIVERGED, Outcome.CANCELLED):
            return free
        starts = [np.clip(free.x, lower, upper), problem.start]
        start = min(starts, key=lambda x: problem.cost_and_gradient(x)[0])
        columns = np.linalg.norm(problem.evaluate(start).jacobian, axis=0)
        scale = 1.0 / np.where(columns > 1e-9 * columns.max(initial=0.0), columns, 1.0)
        history = [free.history[0]]
        minimum, best = np.inf, start

        def cost(y: np.ndarray) -> tuple[float, np.ndarray]:
            nonlocal minimum, best
            x = start + scale * y
            value, gradient = problem.cost_and_gradient(x)
            if value < minimum:
                minimum, best = value, x
            return value, scale * gradient

        def after_iteration(_: np.ndarray) -> None:
            history.append(minimum)
            check_cancelled()

        try:
            answer = minimize(
                cost,
                np.zeros(len(start)),
                jac=True,
                method="SLSQP",
                bounds=Bounds((lower - start) / scale, (upper - start) / scale),
                callback=after_iteration,
                options={"ftol": max(ROUNDING * history[0] * 1e-7, 1e-22), "maxiter": self.limit},
            )
        except Cancelled:
            return SearchOutcome(best, Outcome.CANCELLED, tuple(history))
        x = np.clip(best, lower, upper)
        if answer.success:
            outcome = Outcome.CONVERGED
        elif answer.nit >= self.limit:
            outcome = Outcome.ITERATION_LIMIT
        else:
            factor = factor_of(problem, problem.evaluate(x))
            outcome = ended(factor.predicted_decrease(), [*history, minimum], problem.count)
        return SearchOutcome(x, outcome, tuple(history))
