"""O4: the noise amplification index, which asks for a large and a round ellipsoid at once.

O4 = σmin² / σmax = O2 · O3
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class O4(AbstractSetIndex):
    """Noise amplification index."""

    name = "O4"
    meaning = "noise amplification index: least singular value and roundness together [1/m]"
    source = "Nahvi & Hollerbach, IEEE Int. Conf. Robotics and Automation, 1996"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return spectrum[:, -1] ** 2 / spectrum[:, 0]

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        slope = np.zeros_like(spectrum)
        slope[-1] += 2.0 * spectrum[-1] / spectrum[0]
        slope[0] -= (spectrum[-1] / spectrum[0]) ** 2
        return slope
