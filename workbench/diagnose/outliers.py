"""Rows that no model of the arm explains: mis-seated targets, mistyped numbers. They are set apart and named.

A row's residual is compared with that of the typical row (the median, so that up to half may be wrong), its
leverage taken into account: a row that was fitted leaves less than it was off, one that was not leaves more.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy import stats

from workbench.identify.linear import Factor, factorise
from workbench.identify.problem import Problem

LEVEL = 0.01
"""Chance of calling any row of clean normal data an outlier."""
LEAST = 4.0
"""… and it must be off by this many times the typical row, at least,"""
BEYOND = 3.0
"""… and by this many times what nine rows in ten stay within: real errors have longer tails than normal ones."""


def standing_out(
    problem: Problem, x: Float[np.ndarray, " p"], fitted: Bool[np.ndarray, " rows"], factor: Factor
) -> Bool[np.ndarray, " rows"]:
    """Rows that stand out from the others.

    Args:
        problem: All rows that may be used.
        x: Fit to some of them.
        fitted: Which.
        factor: Factorisation of the Jacobian of those.
    """
    at = problem.evaluate(x)
    rows, live = problem.component_rows, problem.inverse_sigma > 0.0
    measured = np.maximum(np.bincount(rows, live, len(problem.data)), 1.0)
    square = np.bincount(rows, at.residual[: problem.size] ** 2, len(problem.data)) / measured
    half = at.jacobian[: problem.size] @ (factor.vt[factor.seen] / factor.s[factor.seen, None]).T
    leverage = np.bincount(rows, (half**2).sum(1), len(problem.data)) / measured
    room = np.where(fitted, np.maximum(1.0 - leverage, 0.1), 1.0 + leverage)
    size = np.sqrt(square / room)
    return size > _limit(size, measured)


def _limit(size: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """How far a row may be off."""
    typical = float(np.median(size / np.sqrt(stats.chi2.median(measured) / measured)))
    chance = np.sqrt(stats.chi2.isf(LEVEL / len(size), measured) / measured)
    tail = BEYOND * float(np.quantile(size, 0.9)) / max(typical, 1e-300)
    return typical * np.maximum(np.maximum(chance, LEAST), tail)


def factor_of(problem: Problem, x: Float[np.ndarray, " p"]) -> Factor:
    """Factorisation of a problem's Jacobian, prior knowledge included."""
    at = problem.evaluate(x)
    return factorise(at.jacobian, at.residual)
