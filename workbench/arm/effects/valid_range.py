"""Range where a joint's map was identified, and how it fades out beyond.

    w(d) = ½ (1 + cos π d / L),      d < L the distance beyond the range

is 1 within the range and 0 from L on; value and slope are continuous, so that a map times w is as smooth as
the map. L is a few knot distances of the map: farther away, rows within the range carry no information.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

FADING_KNOTS = 3.0
"""Number of knot distances over which a map fades out."""
RANGE_TOLERANCE = 1e-9
"""Tolerance of the range for rounding [rad or m]."""


class Learned(NamedTuple):
    """Range of joint positions where a map was identified.

    Args:
        low: Minimum position [rad or m].
        high: Maximum.
        spacing: Distance between neighbouring knots of the map [rad or m].
    """

    low: float
    high: float
    spacing: float

    def weight(self, q: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Weight of the map at each position, 1 … 0."""
        part = np.minimum(self._distance(q) / (FADING_KNOTS * self.spacing), 1.0)
        return 0.5 * (1.0 + np.cos(np.pi * part))

    def farthest(self, q: Float[np.ndarray, " rows"]) -> tuple[Bool[np.ndarray, " rows"], int]:
        """Which positions lie beyond the range, and the farthest one."""
        distance = self._distance(q)
        return distance > RANGE_TOLERANCE, int(np.argmax(distance))

    def _distance(self, q: np.ndarray) -> np.ndarray:
        return np.maximum(np.maximum(self.low - q, q - self.high), 0.0)


def range_problem(given: tuple[float, ...]) -> str | None:
    """What is wrong with a range in a file; None if nothing is."""
    if not given or (len(given) == 2 and given[0] < given[1]):
        return None
    return f"has range = {list(given)}; give the minimum and the maximum joint position"
