"""OPT1: the cost of ARIA eq. (19) minimised within bounds, the counterpart of `fmincon`.

Where the answer of OLS lies within the bounds it is the answer. Otherwise Gauss–Newton steps from its nearest
point within them: each minimises the linearised cost within the bounds, and is halved until the cost
decreases. Bounds come with the parameters. Steps along unobservable combinations are as small as the bounds
allow.

Source: Stark & Parker, Bounded-variable least squares, Computational Statistics 10, 1995 (one step).
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.base.types import Outcome
from workbench.identification.algorithms.identifier import (
    AbstractIdentifier,
    SearchOutcome,
    descend,
    downhill,
    ended,
    has_converged,
)
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import WEAKLY_OBSERVABLE


@final
class Opt1(AbstractIdentifier):
    """Bounded minimisation of the cost."""

    name = "opt1"
    title = "OPT1"
    summary = "Bounded minimisation of the summed squares: keeps every parameter near its nominal value."

    def search(self, problem: Problem, *, begin: Float[np.ndarray, " p"] | None = None) -> SearchOutcome:
        from scipy.optimize import lsq_linear

        free, (lower, upper) = Ols().search(problem, begin=begin), problem.bounds
        nearest = np.clip(free.x, lower, upper)
        if free.outcome in (Outcome.DIVERGED, Outcome.CANCELLED) or (nearest == free.x).all():
            return free

        def bounded(x, at, factor, cost):
            held = factor.svd.Vh[~factor.seen] / WEAKLY_OBSERVABLE
            table, wanted = np.vstack([factor.r, held]), np.append(factor.compressed, np.zeros(len(held)))
            room = (lower - x) / factor.units, np.nextafter((upper - x) / factor.units, np.inf)
            step = factor.units * lsq_linear(table, wanted, bounds=room, method="bvls").x
            step = np.clip(x + step, lower, upper) - x
            promised = factor.predicted_decrease(step)
            if has_converged(factor, promised, problem.count):
                return Outcome.CONVERGED
            return downhill(problem, x, step, cost) or ended(promised, [cost], problem.count)

        return descend(problem, bounded, begin=nearest)
