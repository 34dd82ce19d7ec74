"""O3: the least singular value, the signal of the worst determined combination of parameters.

    O3 = σmin

Maximising it is E-optimality. Added measurements never lower it.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class O3(AbstractSetIndex):
    """Least singular value."""

    name = "O3"
    meaning = "least singular value: the worst determined combination (E-optimality) [1/m]"
    source = "Nahvi, Hollerbach & Hayward, IEEE Int. Conf. Robotics and Automation, 1994"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return spectrum[:, -1]

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        slope = np.zeros_like(spectrum)
        slope[-1] = 1.0
        return slope
