"""How far the constants of an arm are expected from their nominal values, as a prior of every identification.

Rows always leave some combinations of constants almost open: one reflector on the axis of a wrist shows next
to nothing of its angles. Least squares then takes them wherever the model's own lack pulls, tens of degrees
for a hundredth of a millimetre. Manufactured arms are not that far off, so every constant is expected within
a standard deviation s of nominal, in its natural unit (1 mrad and 1 mm weigh alike on an arm of about a
metre):

    x ~ N(nominal, s² 1)

What the rows show well hardly notices; what they don't show stays nominal. s is the one that makes the rows
most likely (evidence, or type-II maximum likelihood), for the model linearised at a first answer:

    log p(r | s) = −½ Σᵢ [cᵢ² / (1 + s²λᵢ²) + log(1 + s²λᵢ²)]

with λᵢ the singular values of the constants' whitened Jacobian, the frames projected out, and cᵢ the residual
of the nominal arm along its left singular vectors.

Source: MacKay, Bayesian interpolation, Neural Computation 4(3), 1992.
"""

from typing import Final

import numpy as np
from jaxtyping import Float

from workbench.base.errors import OptionError
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.noise import effective_parameters, factor_at
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import RANK_TOLERANCE, Factor

AUTO: Final = "auto"
"""The expected deviation that makes the rows most likely."""
MIN_DEVIATION, MAX_DEVIATION = 1e-4, 0.1
"""Range of expected deviations [rad, m]: better than arms are made, and as bad as one assembled by hand."""
TRIED = 60
"""Expected deviations that are compared between these, evenly in their logarithm."""


def with_expected_deviation(problem: Problem, deviation: float | str = AUTO) -> Problem:
    """A problem whose constants are expected near nominal.

    Args:
        problem: Whitened rows; the arm's constants among its unknowns.
        deviation: Standard deviation of the constants about nominal [rad, m]; `auto`: found from the rows;
            infinite: nothing is expected.
    """
    if isinstance(deviation, str) and deviation != AUTO:
        raise OptionError(
            f"the expected deviation must be '{AUTO}' or a number in rad and m, got '{deviation}'"
        )
    if deviation != AUTO and not float(deviation) > 0.0:
        raise OptionError(f"the expected deviation must be positive [rad, m], got {deviation:g}")
    if deviation == np.inf or not any(p.is_geometry for p in problem.parameters):
        return problem
    if deviation != AUTO:
        return problem.with_deviation(float(deviation))
    begin = problem.with_deviation(MAX_DEVIATION)
    x = Opt2(limit=60).search(begin).x
    factor = factor_at(problem, x)
    spread = _noise_ratio(problem, factor)
    return problem.with_deviation(most_likely(problem, x, factor, spread) / spread)


def most_likely(problem: Problem, x: Float[np.ndarray, " p"], factor: Factor, spread: float = 1.0) -> float:
    """The expected deviation that makes the rows most likely [rad, m].

    Args:
        x: An answer, about which the model is linearised.
        factor: Factorisation of the rows' Jacobian there.
        spread: How many of the stated standard deviations the rows scatter by.
    """
    geometry = np.array([p.is_geometry for p in problem.parameters])
    jacobian = factor.s[:, None] * factor.vt / spread
    own, other = jacobian[:, geometry] / factor.units[geometry], jacobian[:, ~geometry]
    nominal = factor.along / spread + own @ (x - problem.start)[geometry]
    u, size, _ = np.linalg.svd(other, full_matrices=False)
    frames = u[:, size > RANK_TOLERANCE * size.max(initial=0.0)]
    own, nominal = (table - frames @ (frames.T @ table) for table in (own, nominal))
    left, singular, _ = np.linalg.svd(own, full_matrices=False)
    along = (left.T @ nominal) ** 2
    tried = np.geomspace(MIN_DEVIATION, MAX_DEVIATION, TRIED)
    growth = 1.0 + (tried[:, None] * singular) ** 2
    return float(tried[np.argmin((along / growth + np.log(growth)).sum(1))])


def _noise_ratio(problem: Problem, factor: Factor) -> float:
    """Scatter of the rows in stated standard deviations, at most 1; exact rows need no expectation."""
    spare = problem.count - effective_parameters(problem, factor)
    if spare < 1.0:
        return 1.0
    return float(np.clip(np.sqrt(factor.residual_square / spare), 1e-9, 1.0))
