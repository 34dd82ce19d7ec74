"""Figure of the ranking: contribution of each candidate to the geometry alone."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.arm.effects import AbstractEffect
from workbench.diagnosis.result import Diagnosis, judged
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, grid, look, new_figure

MAX_SHOWN = 14
"""Maximum number of candidates drawn."""
NUMBER_WIDTH = 0.12
"""Share of the axis that a number needs left of its dot; with less space it is placed above the line."""


def key(effect: AbstractEffect) -> tuple:
    """Identity of an effect, whatever its size."""
    return str(effect.name), effect.names


def ranking(result: Diagnosis) -> Figure | None:
    """Gain and mean error of the best candidates; None if none was tried."""
    best = result.ranking[:MAX_SHOWN]
    if not best:
        return None
    accepted = {key(found.effect) for found in result.effects}
    mine = np.array([key(r.effect) in accepted for r in best])
    place = np.arange(len(best))[::-1]
    tried = [i for i, r in enumerate(best) if r.held_out_mm is not None and np.isfinite(r.held_out_mm)]
    with look():
        figure = new_figure(10.0, 1.1 + 0.26 * len(best))
        panels = figure.subplots(1, 2 if tried else 1, sharey=True, squeeze=False)[0]
        _gains(panels[0], best, place, mine)
        if tried:
            _errors(panels[1], result, tried, place, np.where(mine, COLOURS[1], NOMINAL))
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _gains(axes: Axes, best, place, mine) -> None:
    """Log evidence."""
    gains = np.array([r.gain for r in best])
    for chosen, colour, text in ((mine, COLOURS[1], "added to the model"), (~mine, NOMINAL, "not added")):
        axes.barh(place[chosen], gains[chosen], color=colour, height=0.65, label=text)
    for y, candidate in zip(place, best, strict=True):
        axes.annotate(f" {candidate.gain:.1f}", (max(candidate.gain, 0.0), y), va="center", fontsize=7)
    axes.set_yticks(place, [r.effect.label for r in best])
    axes.set_xlim(min(0.0, 1.1 * gains.min()), 1.3 * max(gains.max(), 1.0))
    axes.set_xlabel("log evidence that it adds to the geometry alone [nat]")
    grid(axes, "x")


def _errors(axes: Axes, result: Diagnosis, tried: list[int], place, colours) -> None:
    """Mean position error of the geometry with each candidate alone."""
    rows = "held-out" if result.before.held_out is not None else "fitted"
    without = judged(result.before).position_mm.mean
    values = [float(result.ranking[i].held_out_mm or 0.0) for i in tried]
    maximum = 1.15 * max(without, *values)
    for i, value in zip(tried, values, strict=True):
        better = value <= without
        axes.plot([without, value], [place[i]] * 2, color=colours[i], lw=1.2)
        axes.plot(value, place[i], "o", ms=6, color=colours[i])
        left, above = better and value > NUMBER_WIDTH * maximum, better and value <= NUMBER_WIDTH * maximum
        axes.annotate(
            f"{value:.3g}", (value, place[i]), xytext=(-7 if left else 7, 3 if above else 0),
            textcoords="offset points", ha="right" if left else "left",
            va="bottom" if above else "center", fontsize=7,
        )  # fmt: skip
    axes.axvline(without, color=COLOURS[0], lw=1.4, ls="--")
    axes.annotate(
        f"geometry alone {without:.3g}", (without, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2),
        textcoords="offset points", fontsize=7, color=COLOURS[0], ha="center",
    )  # fmt: skip
    axes.set_xlim(0.0, maximum)
    axes.set_xlabel(f"mean error of {rows} rows with it alone [mm]")
    grid(axes, "x")
