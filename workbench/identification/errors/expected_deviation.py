"""How far the constants of an arm are expected from their nominal values, as a prior of every identification.

Some combinations of constants are always weakly observable: a single reflector near the wrist's axis hardly
shows the wrist's angles. Least squares then moves them by tens of degrees to fit a hundredth of a millimetre
of model error. Manufactured arms are not that far off, so every constant is expected within a standard
deviation s of nominal, in its natural unit (1 mrad and 1 mm weigh alike on an arm of about a metre):

    x ~ N(nominal, s² 1)

Well observable constants hardly change; unobservable ones stay nominal. s maximises the evidence (type-II
maximum likelihood) of the model linearised at a first solution:

    log p(r | s) = −½ {ν log[ρ² + Σᵢ cᵢ² / (1 + s²λᵢ²)] + Σᵢ log(1 + s²λᵢ²)}

with λᵢ the singular values of the constants' whitened Jacobian, the frames projected out, cᵢ the nominal
arm's residual along its left singular vectors, ρ² what no constant explains, and ν the numbers left by the
frames; the scale of the noise is integrated out, known as well as from one number. If s isn't clearly above
none, the arm stays nominal.

Source: MacKay, Bayesian interpolation, Neural Computation 4(3), 1992.
"""

from typing import Final

import numpy as np
from jaxtyping import Float
from scipy import linalg

from workbench.base.errors import OptionError
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import thinned
from workbench.identification.noise import degrees_of_freedom, factor_at
from workbench.identification.problem import Problem
from workbench.identification.undetermined_combinations import RANK_TOLERANCE

AUTO: Final = "auto"
"""Option value: estimate the expected deviation from the rows."""
MAX_DEVIATION, USUAL_DEVIATION = 0.1, 1e-3
"""Expected deviation of a constant [rad, m]: the largest, of hand assembly, and a manufactured arm's."""
TRIED = np.concatenate([np.geomspace(1e-6, 1e-4, 40, endpoint=False), np.geomspace(1e-4, MAX_DEVIATION, 60)])
"""Expected deviations that are compared [rad, m], from those of an arm that is calibrated already."""
MIN_EVIDENCE = 2.71
"""Minimum gain in −2 log p over the smallest one: less is chance in one set of twenty."""


def with_expected_deviation(
    problem: Problem, deviation: float | str = AUTO, *, x: Float[np.ndarray, " p"] | None = None
) -> Problem:
    """A problem with the arm's constants expected near nominal, in which each posture counts once.

    Args:
        problem: Whitened rows; the arm's constants among its unknowns.
        deviation: Standard deviation of the constants about nominal [rad, m]; `auto`: estimated from the
            rows; infinite: no prior.
        x: Solution with `MAX_DEVIATION`, if known.
    """
    if deviation != AUTO and (isinstance(deviation, str) or not deviation > 0.0):
        wanted = f"'{AUTO}' or a positive number in rad and m"
        raise OptionError(f"the expected deviation must be {wanted}, got {deviation!r}")
    problem = problem.with_shares()
    if deviation == np.inf or not problem.geometry.any():
        return problem
    if deviation != AUTO:
        return problem.with_deviation(float(deviation))
    found, spread = expected_deviation(problem, x)
    return problem.with_deviation(found / spread)


def expected_deviation(problem: Problem, x: Float[np.ndarray, " p"] | None = None) -> tuple[float, float]:
    """The one with the highest evidence [rad, m], and the scatter of the rows in stated standard deviations.

    Args:
        x: Unknowns at which the model is linearised; those of the widest prior if None.
    """
    if x is None:
        wide = problem.with_deviation(MAX_DEVIATION)
        x = Opt2(limit=60).search(wide, begin=Opt2(limit=60).search(thinned(wide)).x).x
    factor = factor_at(problem, x)
    spare = degrees_of_freedom(problem, factor)
    spread = np.sqrt(factor.residual_square / spare) if spare >= 1.0 else 1.0
    spread = max(float(spread), 1e-9)  # exact rows need no expectation
    geometry, jacobian = problem.geometry, factor.r / spread
    own, other = jacobian[:, geometry] / factor.units[geometry], jacobian[:, ~geometry]
    nominal = factor.compressed / spread + own @ (x - problem.start)[geometry]
    frames = linalg.orth(other, rcond=RANK_TOLERANCE) if other.size else other
    own, nominal = (table - frames @ (frames.T @ table) for table in (own, nominal))
    left, singular, _ = np.linalg.svd(own, full_matrices=False)
    along = (left.T @ nominal) ** 2
    growth = 1.0 + (TRIED[:, None] * singular) ** 2
    unexplained = (factor.residual_square - factor.compressed @ factor.compressed) / spread**2
    unexplained += nominal @ nominal - along.sum()
    square = 1.0 + max(unexplained, 0.0) + (along / growth).sum(1)
    numbers = max(1.0 + len(problem.prior) + problem.count - frames.shape[1], 1.0)
    cost = numbers * np.log(square) + np.log(growth).sum(1)
    best = int(np.argmin(cost))
    return float(TRIED[best if cost[0] - cost[best] > MIN_EVIDENCE else 0]), spread
