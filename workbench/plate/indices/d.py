"""D: D-optimality, the generalised variance of the parameters, per measurement.

    D = det(JᵀJ)^(1/p) / m = (σ1 σ2 … σp)^(2/p) / m = O1²

Its ratio of two sets of m measurements is their D-efficiency: by so much more often the worse set must be
measured to do as well.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class D(AbstractSetIndex):
    """Geometric mean of the squared singular values per measurement."""

    name = "D"
    meaning = "information per measurement, ratios are efficiencies (D-optimality) [1/m²]"
    source = "Atkinson, Donev & Tobias, Optimum Experimental Designs (2007), §11.1"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return np.exp(2.0 * np.log(spectrum).mean(-1)) / measurements

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        return 2.0 * self.of_spectrum(spectrum[None], measurements) / (len(spectrum) * spectrum)
