"""OLS: Gauss–Newton with the minimum-norm step of ordinary least squares (ARIA 4.1.3, eqs. 19–21).

Each step solves J ΔΦ = Δy in the least-squares sense; along unobservable combinations of parameters the
solution nearest to nominal is taken. A step that increases the error is halved; near nominal, as in the
paper, this never happens.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.identification.algorithms.identifier import (
    AbstractIdentifier,
    SearchOutcome,
    descend,
    downhill,
    gauge_step,
)
from workbench.identification.problem import Problem


@final
class Ols(AbstractIdentifier):
    name = "ols"
    title = "OLS"
    summary = "Gauss–Newton steps of minimum norm (ordinary least squares): fast, exact near the nominal arm."

    def search(self, problem: Problem, *, begin: Float[np.ndarray, " p"] | None = None) -> SearchOutcome:
        def halved(x, at, factor, cost):
            return downhill(problem, x, gauge_step(factor, factor.step(), x - problem.start), cost)

        return descend(problem, halved, limit=60, begin=begin)
