"""Prior knowledge from one calibration for the next, in information form: zero where nothing was observed.

A covariance can't represent "unknown"; its inverse can, with a zero. Unknowns that do not carry over (frames,
instruments, a joint that was replaced) are eliminated by the Schur complement, so that knowledge correlated
with them is discounted.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.base.arguments import admit
from workbench.base.errors import OptionError
from workbench.identification.problem import Problem


@dataclass(frozen=True, eq=False)
class Prior:
    """Knowledge of some constants of an arm.

    Args:
        values: Identified values [rad or m].
        information: Inverse covariance [1/rad², 1/m²], singular where a combination was not observable.
    """

    names: tuple[str, ...]
    values: Float[np.ndarray, " k"]
    information: Float[np.ndarray, "k k"]

    def __post_init__(self):
        admit(self)
        count = len(self.names)
        if self.values.shape != (count,) or self.information.shape != (count, count):
            raise OptionError(f"a prior of {count} constants needs as many values, and their information")

    def keep(self, wanted: Callable[[str], bool]) -> "Prior":
        """Knowledge of the given constants; the others become unknown."""
        kept = [i for i, name in enumerate(self.names) if wanted(name)]
        lost = [i for i, name in enumerate(self.names) if not wanted(name)]
        a = self.information
        cross, others = a[np.ix_(kept, lost)], a[np.ix_(lost, lost)]
        own = a[np.ix_(kept, kept)] - cross @ np.linalg.pinv(others, rcond=1e-12) @ cross.T
        return Prior(tuple(self.names[i] for i in kept), self.values[kept], 0.5 * (own + own.T))

    def on(self, problem: Problem) -> Problem:
        """A problem with this knowledge added to its prior."""
        shared = self.keep(lambda name: name in problem.names)
        if not shared.names:
            raise OptionError("the prior knowledge covers none of the constants identified here")
        eigenvalue, vectors = np.linalg.eigh(shared.information)
        whitening = (vectors * np.sqrt(np.maximum(eigenvalue, 0.0))).T  # 0 along unknown directions
        return problem.with_prior(shared.names, shared.values, whitening)
