"""Whether stated odds are kept: probabilities of claims against how often they were true."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from counts import wilson
from matplotlib.figure import Figure

from workbench.report.figures import COLOURS, INK, grid, look, new_figure

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


def reliability(found: Sequence[Bin]) -> Figure:
    """What is kept over what is stated, in log odds, with 95 % bounds and the claims of each bin."""
    with look():
        figure = new_figure(3.6, 3.4)
        axes = figure.subplots()
        axes.axline((0.0, 0.0), slope=1.0, color=INK, alpha=0.4, linewidth=0.8)
        for b in found:
            low, high = (float(_wide(v)) for v in wilson(b.true, b.claims))
            x = float(_wide(b.stated))
            axes.plot([x, x], [low, high], color=COLOURS[0])
            axes.plot(x, float(_wide(b.kept)), "o", color=COLOURS[0], markersize=4.0)
            axes.annotate(f"{b.claims}", (x, high), (0, 2), textcoords="offset points", ha="center")
        shown = (0.1, 0.5, 0.9, 0.99, 0.999)
        places = [float(_wide(p)) for p in shown]
        axes.set_xticks(places, [f"{100 * p:g} %" for p in shown])
        axes.set_yticks(places, [f"{100 * p:g} %" for p in shown])
        axes.set_xlabel("stated probability")
        axes.set_ylabel("claims that are true")
        axes.set_title(f"{sum(b.claims for b in found)} claims, expected error {expected_error(found):.1%}")
        axes.set(aspect="equal", xlim=(-2.2, 4.5), ylim=(-2.2, 4.5))
        grid(axes, "both")
    return figure


def _wide(p):
    """Log odds, ends drawn in to one in ten thousand."""
    p = np.clip(p, 1e-4, 1 - 1e-4)
    return np.log10(p / (1 - p))
