"""I: I-optimality, the error that the calibrated arm will make where it matters.

    I = 1/√trace(W C),      C = (JᵀJ)⁻¹,      W = mean of J_p(q)ᵀ J_p(q) over poses that matter

trace(W C) is the mean square position error over those poses for the instrument's noise (see
`plate.accuracy`), so 1/I is the number that users care about, in metres. It is of the scaled Jacobian,
though the scaling cancels. W comes with the robot and the region, so this index is made, not registered:
`I(position_weight(…))`.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation
from workbench.base.types import frozen
from workbench.plate.indices.index import AbstractIndex


@final
class I(AbstractIndex):  # noqa: E742 - the literature's name
    """Inverse root mean square predicted position error over poses that matter."""

    name = "I"
    meaning = "inverse predicted position error over the region (I-optimality) [1/m]"
    source = "Atkinson, Donev & Tobias, Optimum Experimental Designs (2007), §10.6"

    def __init__(self, weight: Float[np.ndarray, "p p"]):
        """The index for a W of the scaled parameters [m² per m²], see `accuracy.position_weight`."""
        self.weight = frozen(weight)

    def value(self, linearisation: Linearisation) -> float:
        if linearisation.rank() < len(linearisation.names):
            return 0.0
        root = _root(linearisation)
        return float(1.0 / np.sqrt(np.einsum("ij,ik,jk->", self.weight, root, root)))

    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        if linearisation.rank() < len(linearisation.names):
            return np.zeros_like(linearisation.jacobian)
        root = _root(linearisation)
        covariance = root @ root.T
        slope = linearisation.scaled @ covariance @ self.weight @ covariance
        return self.value(linearisation) ** 3 * slope * linearisation.weights

    def contributions(self, linearisation: Linearisation) -> Float[np.ndarray, " measurements"]:
        rest = [self.value(linearisation.without(k)) for k in range(linearisation.measurements)]
        return self.value(linearisation) - np.array(rest)


def _root(linearisation: Linearisation) -> Float[np.ndarray, "p p"]:
    """V/σ, whose square is C of the scaled parameters."""
    _, values, vt = linearisation.factors
    return vt.T / values
