"""A problem at its optimum, and the F test between two of them.

    F = ((Q₀ − Q) / k) / (Q / ν),     Q the squared residuals, whitened by the noise of the freer model

with k further unknowns and ν numbers to spare.

Source: Seber & Wild, Nonlinear Regression, 1989, §5.3.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy import special

from workbench.identification import noise as noises
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.instrument_preparation import preparation_of
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import Factor

NOISE_ROUNDS = 4
"""Rounds of fit and noise."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """A problem at its optimum.

    Args:
        problem: Whitened by the noise that counts.
        x: The optimum [rad or m].
        square: Whitened squared residuals there, those of the prior included.
        measured: Whether the noise was measured; else it is what this fit leaves.
    """

    problem: Problem
    x: Float[np.ndarray, " p"]
    square: float
    measured: bool

    @classmethod
    def of(cls, problem: Problem, *, measured: bool) -> "Optimum":
        """The optimum of a problem, with the noise that it leaves unless that was measured."""
        found = cls.fitted(problem, problem.start, measured)
        for _ in range(0 if measured else NOISE_ROUNDS - 1):
            now, x = found.problem, found.x
            left = preparation_of(now.data).noise_left(now, x)
            old = now.noise
            if left is None or np.allclose([*left[:2], left.own], [*old[:2], old.own], rtol=0.02, atol=1e-7):
                break
            found = cls.fitted(now.with_noise(left), x, measured)
        return found

    @classmethod
    def fitted(cls, problem: Problem, begin: Float[np.ndarray, " p"], measured: bool) -> "Optimum":
        """The optimum of a problem with the noise that it has."""
        search = Opt2(limit=60).search(problem, begin=begin)
        return cls(problem, search.x, 2.0 * search.history[-1], measured)

    @cached_property
    def factor(self) -> Factor:
        """Factorisation at the optimum, prior knowledge included."""
        return noises.factor_at(self.problem, self.x)

    @cached_property
    def spare(self) -> float:
        """Measured numbers beyond those that the unknowns took; at least one."""
        return max(noises.degrees_of_freedom(self.problem, self.factor), 1.0)

    @cached_property
    def mean_square(self) -> float:
        """Squared residuals per degree of freedom: 1 where the noise is as taken."""
        known = len(self.problem.prior)
        return self.square / max(self.problem.count + known - self.factor.rank, 1)

    @cached_property
    def values(self) -> dict[str, float]:
        return self.problem.named(self.x)

    def quantile(self, level: float) -> float:
        """Standard deviations within which an unknown lies; Student's where the fit gives the noise."""
        known = self.measured or noises.share_stated(self.problem) == 1.0
        tail = 0.5 + 0.5 * level
        return float(special.ndtri(tail) if known else special.stdtrit(self.spare, tail))

    def against(self, other: "Optimum", further: int) -> tuple[float, float]:
        """How this freer model stands against another.

        Args:
            other: A model with less freedom, or with more rows.
            further: How many unknowns, or rows' numbers, it has less.

        Returns:
            Probability that chance alone makes this one so much better; and how many times as much the other
            leaves.
        """
        same = self.fitted(other.problem.with_noise(self.problem.noise), other.x, other.measured)
        gained = max(same.square - self.square, 0.0) / further
        minimum = max(self.mean_square, 1e-300)
        chance = float(special.fdtrc(further, self.spare, gained / minimum))
        return chance, float(np.sqrt(same.mean_square / minimum))
