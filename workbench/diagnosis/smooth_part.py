"""Part of a model's residual that is smooth over postures or row order.

The mean product of neighbours' residuals estimates the variance of their common part. Noise has none.
"""

import numpy as np

from workbench.data.order import clock_of
from workbench.diagnosis.structure import neighbours
from workbench.identification.problem import Problem

EVIDENT = 3.0
"""Standard errors by which neighbours must agree to be significant."""
MIN_ROWS = 20
"""Minimum number of rows."""


def smooth_part(problem: Problem, x: np.ndarray) -> float:
    """Standard deviation of the smooth part of a whitened component at x; 0 if it is not significant."""
    data = problem.data
    if len(data) < MIN_ROWS:
        return 0.0
    rows = np.zeros((len(data), max(b.inverse_sigma.shape[1] for b in problem.blocks)))
    residual = problem.residual(x)
    for block in problem.blocks:
        part = residual[block.start : block.stop].reshape(len(block.rows), -1)
        rows[block.rows, : part.shape[1]] = part
    q = data.q / np.maximum(np.ptp(data.q, axis=0), 1e-9)
    in_order = rows[np.argsort(clock_of(data)[0], kind="stable")]
    products = (rows * rows[neighbours(q, 1)[:, 0]]).sum(1), (in_order[1:] * in_order[:-1]).sum(1)
    alike = [p.sum() / problem.count for p in products if p.sum() > EVIDENT * np.sqrt(p @ p)]
    return float(np.sqrt(max(alike, default=0.0)))
