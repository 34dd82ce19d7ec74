"""What each measurement contributes: how much larger the predicted error would be without it.

    C₋ᵢ = C + K (I − S)⁻¹ Kᵀ,     K = C Aᵢᵀ,     S = Aᵢ C Aᵢᵀ

C is the covariance with all measurements, Aᵢ the whitened rows of one; S has an eigenvalue of 1 where only
that measurement sees some combination of parameters.

Source: Golub & Van Loan, Matrix Computations (4th ed.), §2.1.4 (Sherman–Morrison–Woodbury).
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation

LEAST_LEFT = 1e-9
"""Share of information left without a measurement below which nothing is left."""


def rise_without_each(
    linearisation: Linearisation, weight: Float[np.ndarray, "p p"]
) -> Float[np.ndarray, " measurements"]:
    """Relative rise of the root mean square error without each measurement.

    Args:
        linearisation: All measurements; below full rank nothing can be said.
        weight: W with trace(W C) = mean square error, such as `accuracy.position_weight`.

    Returns:
        0.1 for 10 % more; infinite where parameters could no longer be told apart; NaN below full rank.
    """
    count = linearisation.measurements
    if linearisation.rank() < len(linearisation.names):
        return np.full(count, np.nan)
    covariance = linearisation.covariance
    square = float((weight * covariance).sum())
    starts = np.searchsorted(linearisation.measurement, np.arange(count + 1))
    rises = [_rise(linearisation.jacobian[a:b], covariance, weight) for a, b in pairwise(starts)]
    return np.sqrt(1.0 + np.array(rises) / square) - 1.0


def _rise(rows: np.ndarray, covariance: np.ndarray, weight: np.ndarray) -> float:
    """Rise of trace(W C) without these rows."""
    gain = covariance @ rows.T
    left = np.eye(len(rows)) - rows @ gain
    values, vectors = np.linalg.eigh(left)
    if values[0] < LEAST_LEFT:
        return np.inf
    turned = gain @ vectors
    return float(((turned * (weight @ turned)).sum(0) / values).sum())
