"""Whether stated odds are kept: probabilities of claims against how often they were true."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.999, 1.0)
"""Of the bins; most claims state a probability near 1."""


@dataclass(frozen=True)
class Bin:
    """Claims that state about the same probability.

    Args:
        claims: How many.
        stated: Mean of what they state.
        true: How many are true.
    """

    claims: int
    stated: float
    true: int

    @property
    def kept(self) -> float:
        """Share that is true."""
        return self.true / self.claims


def bins(odds: Sequence[tuple[float, bool]]) -> list[Bin]:
    """Claims by what they state; bins without any are left out."""
    stated, true = (np.array([o[k] for o in odds]) for k in (0, 1))
    place = np.clip(np.searchsorted(EDGES, stated, side="right") - 1, 0, len(EDGES) - 2)
    return [
        Bin(int(m.sum()), float(stated[m].mean()), int(true[m].sum()))
        for m in (place == k for k in range(len(EDGES) - 1))
        if m.any()
    ]


def expected_error(found: Sequence[Bin]) -> float:
    """Expected calibration error: mean gap of stated and kept over all claims.

    Source: Naeini, Cooper and Hauskrecht (2015), eq. (3), with our bins.
    """
    return sum(b.claims * abs(b.kept - b.stated) for b in found) / max(sum(b.claims for b in found), 1)
