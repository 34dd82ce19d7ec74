"""A problem at its optimum, and the F test between two of them.

    F = ((Q₀ − Q) / k) / (Q / ν),     Q = ν exp((−2 ln L − ν) / N)

with k further unknowns, ν numbers of N to spare, and L the likelihood of a model with its own noise: Q is
the squared residuals where the noise is one number and nothing is known of the constants.

Source: Seber & Wild, Nonlinear Regression, 1989, §5.3.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy import special

from workbench.arm.robot import Robot
from workbench.extras.service.rezero.last_calibration import UNKNOWN, LastCalibration
from workbench.identification import noise as noises
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import align
from workbench.identification.errors.row_errors import Errors, row_errors
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
        least: Noise below which no fit of few rows gets, as base, tool and lengths are known no better [m],
            [rad]; None: the noise was measured. Else it is what this fit leaves.
        spent: Number of unknowns that were found beforehand.
    """

    problem: Problem
    x: Float[np.ndarray, " p"]
    square: float
    least: Float[np.ndarray, "2"] | None
    spent: int = 0

    @classmethod
    def of(cls, problem: Problem, least: Float[np.ndarray, "2"] | None) -> "Optimum":
        """The optimum of a problem, with the noise that it leaves unless that was measured."""
        x = problem.start
        for _ in range(NOISE_ROUNDS):
            search = Opt2(limit=60).search(problem, begin=x)
            x, old = search.x, problem.noise
            found = cls(problem, x, 2.0 * search.history[-1], least)
            left = None if least is None else preparation_of(problem.data).noise_left(problem, x)
            if left is not None and least is not None and not problem.own_sigma.any():
                position, rotation = np.fmax(left[:2], least)
                left = left._replace(position=position, rotation=rotation)
            if left is None or np.allclose([*left[:2], left.own], [*old[:2], old.own], rtol=0.02, atol=1e-7):
                break
            problem = problem.with_noise(left)
        return found

    def freed(self, knowledge: LastCalibration, loose: Sequence[str], **choices: Any) -> "Optimum":
        """The optimum with what a calibration knows but of some constants, from this one on.

        Args:
            loose: Constants of which nothing is known.
            **choices: Other rows (`data`) or frames, as `Problem.again` takes them.
        """
        robot, free = self.problem.robot_at(self.x), knowledge.known.names
        problem = self.problem.again(robot=robot, free=free, **choices)
        return Optimum.of(knowledge.without(*loose).on(problem), self.least)

    @cached_property
    def factor(self) -> Factor:
        """Factorisation at the optimum, prior knowledge included."""
        return noises.factor_at(self.problem, self.x)

    @cached_property
    def spare(self) -> float:
        """Measured numbers beyond those that the unknowns took; at least one."""
        return max(noises.degrees_of_freedom(self.problem, self.factor), 1.0)

    @cached_property
    def known(self) -> Bool[np.ndarray, " p"]:
        """Unknowns of which the calibration tells more than that it is near."""
        return (self.problem.prior**2).sum(0) > 2.0 / UNKNOWN**2

    @cached_property
    def misjudged(self) -> float:
        """How many times as far off as is known the constants are, at least 1: |W (x − x̂)| / √tr(1 − W C Wᵀ),
        W what whitens them, C the covariance that the rows leave."""
        prior, at = self.problem.prior[:, self.known], self.problem.prior_centre
        off, left = (self.x - at)[self.known], self.factor.covariance()[np.ix_(self.known, self.known)]
        told = self.known.sum() - np.trace(prior @ left @ prior.T)
        return max(1.0, float(np.linalg.norm(prior @ off) / np.sqrt(max(told, 1.0))))

    @cached_property
    def freedom(self) -> int:
        """Measured numbers beyond the unknowns of which nothing was known; 0 or less where none is left."""
        return self.problem.count + int(self.known.sum()) - self.factor.rank - self.spent

    @cached_property
    def mean_square(self) -> float:
        """Squared residuals per degree of freedom: 1 where the noise is as taken."""
        return self.square / max(self.freedom, 1)

    def errors(self, robot: Robot) -> Errors:
        """Errors of an arm on the rows."""
        return row_errors(robot, self.problem.data, known=self.problem.known)

    def aligned(self, robot: Robot) -> Robot:
        """An arm on the base and with the tool that suit the rows best, wherever these are free."""
        problem = self.problem
        return align(robot, problem.data, problem.frames, noise=problem.noise, known=problem.known)

    def quantile(self, level: float) -> float:
        """Standard deviations within which an unknown lies; Student's where the fit gives the noise."""
        known = self.least is None or noises.share_stated(self.problem) == 1.0
        tail = 0.5 + 0.5 * level
        return float(special.ndtri(tail) if known else special.stdtrit(self.spare, tail))

    def against(self, other: "Optimum") -> tuple[float, float]:
        """How this freer model stands against one with fewer unknowns, or with more rows.

        Returns:
            Probability that chance alone makes this one so much better; and how many times as much the other
            leaves.
        """
        further = other.freedom - self.freedom
        if min(self.freedom, further) < 1:
            return 1.0, 1.0
        names = [n for n in other.problem.names if n in set(compress(self.problem.names, self.known))]
        prior = self.problem.prior[:, [self.problem.names.index(n) for n in names]]
        mine, others = (max(fit._left(names, prior.T @ prior), 1e-300) for fit in (self, other))
        gained = max(others * other.freedom - mine * self.freedom, 0.0) / further
        return float(special.fdtrc(further, self.freedom, gained / mine)), float(np.sqrt(others / mine))

    def _left(self, known: Sequence[str], information: Float[np.ndarray, "k k"]) -> float:
        """As `mean_square`, but for noise that differs between models: by the likelihood in which constants
        of which there is this information are integrated over.
        """
        if self.least is None:
            return self.mean_square
        problem, at = self.problem, [self.problem.names.index(n) for n in known]
        rows = problem.evaluate(self.x).jacobian[: problem.size, at]
        volume = np.subtract(*np.linalg.slogdet([information + rows.T @ rows, information])[1])
        scatter = -2.0 * np.log(problem.inverse_sigma[problem.inverse_sigma > 0.0]).sum()
        return float(np.exp((self.square + scatter + volume - self.freedom) / problem.count))
