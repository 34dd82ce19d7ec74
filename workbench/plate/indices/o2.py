"""O2: the inverse condition number of the whole set's Jacobian.

    O2 = σmin / σmax

It bounds how much relative errors of the measurements can grow in the parameters. Scaling all rows alike
or adding the same poses again changes nothing; scaling single columns does.
"""

from typing import final

import numpy as np
from jaxtyping import Float

from workbench.plate.indices.index import AbstractSetIndex, Spectra


@final
class O2(AbstractSetIndex):
    """Inverse condition number of the set."""

    name = "O2"
    meaning = "inverse condition number: how evenly the parameters show"
    source = "Driels & Pathre, J. Robotic Systems 7(2), 1990"

    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        return spectrum[:, -1] / spectrum[:, 0]

    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        slope = np.zeros_like(spectrum)
        slope[-1] += 1.0 / spectrum[0]
        slope[0] -= spectrum[-1] / spectrum[0] ** 2
        return slope
