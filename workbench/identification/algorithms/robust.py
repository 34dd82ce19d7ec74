"""Robust loss: rows with large residuals get less weight or none, so that a few bad ones do not distort the
model.

By default rows that no arm explains are set apart (`identification/outlying_rows.py`) and all others count as
they are. Or iteratively reweighted least squares by whole rows: a row's weight follows from its standardised
residual under Huber's or Tukey's function, with the scale from the median; the fit is repeated until the
weights converge. Uncertainties then come from the reweighted problem's own factorisation.

Source: Holland, Welsch, Robust regression using iteratively reweighted least-squares, 1977.
"""

from enum import StrEnum

import numpy as np
from jaxtyping import Float

CONSISTENCY = 1.345
"""Huber's constant: 95 % efficiency for normal errors."""
BIWEIGHT = 4.685
"""Tukey's constant, likewise."""


class Loss(StrEnum):
    """How residuals are counted."""

    SET_APART = "set-apart"
    SQUARES = "squares"
    HUBER = "huber"
    TUKEY = "tukey"


def row_weights(standardised: Float[np.ndarray, " rows"], loss: Loss) -> Float[np.ndarray, " rows"]:
    """Factors of the rows' residuals (root of the weights), from residuals in units of their scale.

    The scale is the median residual, so that up to half of the rows may be wrong.
    """
    if loss in (Loss.SQUARES, Loss.SET_APART):
        return np.ones_like(standardised)
    size = standardised / max(float(np.median(standardised)), 1e-12)
    if loss is Loss.HUBER:
        return np.sqrt(np.minimum(1.0, CONSISTENCY / np.maximum(size, 1e-12)))
    return np.maximum(1.0 - (size / BIWEIGHT) ** 2, 0.0)
