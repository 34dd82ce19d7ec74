"""Where the map of a joint was learned, and how it fades out beyond.

    w(d) = ½ (1 + cos π d / L),      d < L the distance beyond the range

is 1 within the range and 0 from L on; value and slope are continuous, so that a map times w is as smooth as
the map. L is a few of the map's own distances between neighbouring knots: beyond, rows within say nothing.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

DISTANCES = 3.0
"""Distances between knots over which a map fades out."""
ROUNDING = 1e-9
"""How far outside the range a joint may be by rounding [rad or m]."""


class Learned(NamedTuple):
    """A range of joint positions.

    Args:
        low: Minimum position [rad or m].
        high: Maximum.
        spacing: Distance between neighbouring knots of the map [rad or m].
    """

    low: float
    high: float
    spacing: float

    def weight(self, q: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """How much of the map counts at each position, 1 … 0."""
        part = np.minimum(self._distance(q) / (DISTANCES * self.spacing), 1.0)
        return 0.5 * (1.0 + np.cos(np.pi * part))

    def farthest(self, q: Float[np.ndarray, " rows"]) -> tuple[Bool[np.ndarray, " rows"], int]:
        """Which positions lie beyond, and the one that does most."""
        distance = self._distance(q)
        return distance > ROUNDING, int(np.argmax(distance))

    def _distance(self, q: np.ndarray) -> np.ndarray:
        return np.maximum(np.maximum(self.low - q, q - self.high), 0.0)


def range_problem(given: tuple[float, ...]) -> str | None:
    """What is wrong with a range as a file gives it; None if nothing is."""
    if not given or (len(given) == 2 and given[0] < given[1]):
        return None
    return f"has range = {list(given)}; give the minimum and the maximum joint position"
