"""How much of what a model leaves is smooth over postures, in the order of rows, or along another axis.

The mean product of neighbours' residuals estimates the variance of their common part. Noise has none.
"""

import numpy as np
from jaxtyping import Float

from workbench.diagnosis.claims.structure import RowRemainder, Structure, neighbours
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise

SIGNIFICANT_ERRORS = 3.0
"""Standard errors by which neighbours must agree to be significant."""
MIN_ROWS = 20
"""Minimum number of rows."""


def smooth_part(fit: Fit, noise: Noise, structure: Structure) -> float:
    """Standard deviation of the smooth part of a component, whitened by a noise; 0 where it may be chance.

    Args:
        structure: Along which axes neighbours agree in what the fit leaves.
    """
    if len(fit.problem.data) < MIN_ROWS:
        return 0.0
    left = RowRemainder(fit, noise)
    rows, q = left.views["frame"], left.data.q / np.maximum(np.ptp(left.data.q, axis=0), 1e-9)
    products = (rows * rows[neighbours(q, 1)[:, 0]]).sum(1), _in_turn(rows)
    alike = [float(p.mean()) for p in products if p.sum() > SIGNIFICANT_ERRORS * np.sqrt(p @ p)]
    alike += [float(_in_turn(left.views[a.view][np.argsort(a.value)]).mean()) for a in structure.found]
    return float(np.sqrt(max([0.0, *alike]) * len(fit.problem.data) / fit.problem.count))


def _in_turn(rows: Float[np.ndarray, "rows w"]) -> Float[np.ndarray, " pairs"]:
    """Products of rows with the next ones."""
    return (rows[1:] * rows[:-1]).sum(1)
