"""O1: the volume of the ellipsoid that the parameters' unit ball becomes in the measurements.

    O1 = (σ1 σ2 … σp)^(1/p) / √m,        m measurements

Maximising it is D-optimality, det(JᵀJ) → max. Scaling columns or rows multiplies it by a constant, so the
choice of poses does not depend on units.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class O1(AbstractSetIndex):
    """Geometric mean of the singular values over the root of the number of measurements."""

    name = "O1"
    meaning = "geometric mean of the singular values: overall information (D-optimality)"
    source = "Borm & Menq, Int. J. Robotics Research 10(1), 1991"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return np.exp(np.log(spectrum).mean(-1)) / np.sqrt(measurements)

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        return self.of_spectrum(spectrum[None], measurements) / (len(spectrum) * spectrum)
