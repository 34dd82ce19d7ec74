"""A: A-optimality, the mean variance of the parameters.

    A = √(p / (1/σ1² + 1/σ2² + … + 1/σp²))

It is one over the root mean square standard error of the scaled parameters: trace((JᵀJ)⁻¹) → min.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class A(AbstractSetIndex):
    """Inverse root mean square standard error."""

    name = "A"
    meaning = "inverse root mean square standard error of the parameters (A-optimality) [1/m]"
    source = "Atkinson, Donev & Tobias, Optimum Experimental Designs (2007), §10.1"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return np.sqrt(spectrum.shape[-1] / (1.0 / spectrum**2).sum(-1))

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        return (self.of_spectrum(spectrum[None], measurements) / spectrum) ** 3 / len(spectrum)
