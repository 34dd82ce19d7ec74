"""O5: the inverse of the sum of the inverse singular values.

    O5 = 1 / (1/σ1 + 1/σ2 + … + 1/σp)

Near to A-optimality, which sums 1/σ². Added measurements never lower it.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class O5(AbstractSetIndex):
    """Harmonic sum of the singular values."""

    name = "O5"
    meaning = "inverse of the summed inverse singular values: standard errors (near to A-optimality) [1/m]"
    source = "Sun & Hollerbach, IEEE Int. Conf. Robotics and Automation, 2008"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return 1.0 / (1.0 / spectrum).sum(-1)

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        return (self.of_spectrum(spectrum[None], measurements) / spectrum) ** 2
