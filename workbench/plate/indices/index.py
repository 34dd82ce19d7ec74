"""What an observability index is, and what all indices of a whole set share.

The indices of a set look at the singular values σ of the scaled, whitened Jacobian (see
`workbench.arm.linearisation` for the scaling): σ is zero where a parameter can't be seen, and every
index is then zero. Larger is better for all of them. The gradient comes from dσ_k = u_kᵀ dJ v_k.
"""

from abc import ABC, abstractmethod
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import RANK_TOLERANCE, Linearisation

Spectra = Float[np.ndarray, "sets p"]


class AbstractIndex(ABC):
    """An observability index: a number for a linearisation, larger is better.

    Attributes:
        name: Its short name in the registry and on the command line.
        meaning: What it measures, in a few words for people.
        source: Where it was proposed.
    """

    name: str
    meaning: str
    source: str

    @abstractmethod
    def value(self, linearisation: Linearisation) -> float:
        """The index."""

    @abstractmethod
    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        """Its derivative by each entry of the whitened Jacobian `linearisation.jacobian`."""

    @abstractmethod
    def contributions(self, linearisation: Linearisation) -> Float[np.ndarray, " measurements"]:
        """What the index loses when each measurement is left out; negative where it would gain."""


class AbstractSetIndex(AbstractIndex):
    """An index of the singular values of a whole set of measurements."""

    @abstractmethod
    def of_spectrum(self, spectrum: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        """The index of full-rank spectra, largest value first, each of a set of so many measurements."""

    @abstractmethod
    def slope(self, spectrum: Float[np.ndarray, " p"], measurements: int) -> Float[np.ndarray, " p"]:
        """Its derivative by each singular value."""

    def value(self, linearisation: Linearisation) -> float:
        return float(self.of_spectra(linearisation.spectrum[None], linearisation.measurements)[0])

    def of_spectra(self, spectra: Spectra, measurements: int) -> Float[np.ndarray, " sets"]:
        """The index of any spectra; zero for those below full rank."""
        seen = spectra[:, -1] > RANK_TOLERANCE * np.maximum(spectra[:, 0], np.finfo(float).tiny)
        safe = np.where(seen[:, None], spectra, 1.0)
        return np.where(seen, self.of_spectrum(safe, measurements), 0.0)

    def gradient(self, linearisation: Linearisation) -> Float[np.ndarray, "m p"]:
        if linearisation.rank() < len(linearisation.names):
            return np.zeros_like(linearisation.jacobian)
        u, values, vt = linearisation.factors
        return (u * self.slope(values, linearisation.measurements)) @ vt * linearisation.weights

    def contributions(self, linearisation: Linearisation) -> Float[np.ndarray, " measurements"]:
        """What the index loses without each measurement, from the downdated JᵀJ − AᵢᵀAᵢ of each.

        The squares halve the number of digits: a set that has a condition number above 1e6 without a
        measurement counts as one that no longer sees every parameter.
        """
        count = linearisation.measurements
        rest = downdated_spectra(linearisation)
        seen = rest[:, -1] > 1e-6 * rest[:, 0]
        left = np.where(seen, self.of_spectra(np.where(seen[:, None], rest, 1.0), max(count - 1, 1)), 0.0)
        return self.value(linearisation) - left


def downdated_spectra(linearisation: Linearisation) -> Float[np.ndarray, "measurements p"]:
    """Singular values of the set without each measurement, largest first."""
    scaled = linearisation.scaled
    starts = np.searchsorted(linearisation.measurement, np.arange(linearisation.measurements + 1))
    blocks = [scaled[a:b] for a, b in pairwise(starts)]
    grams = (scaled.T @ scaled)[None] - np.stack([block.T @ block for block in blocks])
    return np.sqrt(np.clip(np.linalg.eigvalsh(grams)[:, ::-1], 0.0, None))
