"""OLS: Gauss–Newton with the minimum-norm step of ordinary least squares (ARIA 4.1.3, eqs. 19–21).

Each step solves J ΔΦ = Δy in the least-squares sense; where the rows leave a combination of parameters
open, the solution nearest to nominal is taken. A step that makes the error larger is halved, which the
paper's version does not need near nominal and which costs nothing there.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.base.types import Outcome
from workbench.identification.algorithms.identifier import (
    AbstractIdentifier,
    OnStep,
    Search,
    ended,
    gauge_step,
    settled,
)
from workbench.identification.factorisation import factorise
from workbench.identification.problem import Problem


@final
@dataclass(frozen=True)
class Ols(AbstractIdentifier):
    """Gauss–Newton.

    Args:
        limit: Greatest number of iterations.
        halvings: How often a step may be halved.
    """

    limit: int = 60
    halvings: int = 12
    name = "ols"
    title = "OLS"
    summary = "Gauss–Newton steps of least length (ordinary least squares): fast, exact near the nominal arm."

    def search(self, problem: Problem, *, on_step: OnStep | None = None) -> Search:
        x = problem.start.copy()
        at = problem.evaluate(x)
        history = [0.5 * float(at.residual @ at.residual)]
        for iteration in range(self.limit):
            if not np.isfinite(history[-1]):
                return Search(x, Outcome.DIVERGED, tuple(history))
            if on_step and on_step(iteration, history[-1]):
                return Search(x, Outcome.CANCELLED, tuple(history))
            factor = factorise(at.jacobian, at.residual, problem.units)
            if settled(factor, factor.predicted_decrease(), problem.count):
                return Search(x, Outcome.CONVERGED, tuple(history))
            step = gauge_step(factor, factor.step(), x - problem.start)
            for _ in range(self.halvings):
                trial = problem.evaluate(x + step)
                cost = 0.5 * float(trial.residual @ trial.residual)
                if cost < history[-1]:
                    break
                step = step / 2
            else:
                return Search(x, ended(factor.predicted_decrease(), history, problem.count), tuple(history))
            x, at = x + step, trial
            history.append(cost)
        return Search(x, Outcome.ITERATION_LIMIT, tuple(history))
