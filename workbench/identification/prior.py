"""What one calibration knows for the next, as information: nothing where nothing was seen.

A covariance can't say "unknown"; its inverse can, with a zero. Unknowns that do not carry over (frames,
instruments, a joint that was replaced) are eliminated by the Schur complement, so that what was known only
together with them is not taken for known.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.base.errors import OptionError
from workbench.identification.fit import Fit
from workbench.identification.problem import Problem


@dataclass(frozen=True, eq=False)
class Prior:
    """Knowledge of some constants of an arm.

    Args:
        values: What they were found to be [rad or m].
        information: Inverse covariance [1/rad², 1/m²], singular where a combination was not seen.
    """

    names: tuple[str, ...]
    values: Float[np.ndarray, " k"]
    information: Float[np.ndarray, "k k"]

    @classmethod
    def of(cls, fit: Fit) -> "Prior":
        """What a fit knows of the arm's constants, whatever its frames and instruments were."""
        information = fit.factor.information() / max(fit.variance_factor, 1e-300)
        everything = cls(fit.problem.names, fit.x, information)
        geometry = {p.name for p in fit.parameters if p.is_geometry}
        return everything.keep(lambda name: name in geometry)

    def keep(self, wanted: Callable[[str], bool]) -> "Prior":
        """Knowledge of the wanted constants, the others being unknown."""
        kept = [i for i, name in enumerate(self.names) if wanted(name)]
        lost = [i for i, name in enumerate(self.names) if not wanted(name)]
        a = self.information
        information = a[np.ix_(kept, kept)]
        if lost:
            cross = a[np.ix_(kept, lost)]
            information = information - cross @ np.linalg.pinv(a[np.ix_(lost, lost)], rcond=1e-12) @ cross.T
        return Prior(
            tuple(self.names[i] for i in kept), self.values[kept], 0.5 * (information + information.T)
        )

    def on(self, problem: Problem) -> Problem:
        """A problem with this knowledge of its unknowns, beside what it knows already."""
        shared = self.keep(lambda name: name in problem.names)
        if not shared.names:
            raise OptionError("the prior knowledge speaks of none of the constants that are identified here")
        return problem.with_prior(shared.names, shared.values, shared.whitening)

    @property
    def whitening(self) -> Float[np.ndarray, "k k"]:
        """W with Wᵀ W = information; rows of zeros where nothing is known."""
        eigenvalue, vectors = np.linalg.eigh(self.information)
        return (vectors * np.sqrt(np.maximum(eigenvalue, 0.0))).T
