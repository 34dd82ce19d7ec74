"""How much of what a model leaves is smooth over postures, or in the order of the rows.

The mean product of neighbours' residuals estimates the variance of what both share. Noise shares nothing.
"""

import numpy as np

from workbench.data.order import clock_of
from workbench.diagnosis.structure import neighbours
from workbench.identification.problem import Problem

EVIDENT = 3.0
"""Standard errors by which neighbours must agree to be called alike."""
MIN_ROWS = 20
"""Rows below which nothing is smooth."""


def smooth_part(problem: Problem, x: np.ndarray) -> float:
    """Standard deviation of a whitened component's smooth part at x; 0 where it may be chance."""
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
