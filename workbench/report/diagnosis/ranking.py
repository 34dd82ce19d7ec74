"""Picture of the ranking: what each candidate would have brought to the geometry alone."""

import numpy as np
from matplotlib.figure import Figure

from workbench.diagnose.record import Diagnosis, judged
from workbench.diagnose.words import label
from workbench.effects import AbstractEffect
from workbench.report.drawing import COLOURS, NOMINAL, grid, look, new_figure

SHOWN = 14
"""Most candidates that are drawn."""


def key(effect: AbstractEffect) -> tuple:
    """What makes two effects the same, whatever their sizes."""
    return str(effect.name), effect.names


def ranking(result: Diagnosis) -> Figure | None:
    """Gain and mean error of the best candidates; None if none was tried."""
    best = result.ranking[:SHOWN]
    if not best:
        return None
    accepted = {key(found.effect) for found in result.effects}
    mine = np.array([key(r.effect) in accepted for r in best])
    place = np.arange(len(best))[::-1]
    colours = np.where(mine, COLOURS[1], NOMINAL)
    with look():
        figure = new_figure(10.0, 1.3 + 0.24 * len(best))
        left, right = figure.subplots(1, 2, sharey=True)
        gains = np.array([r.gain for r in best])
        left.barh(place[mine], gains[mine], color=COLOURS[1], height=0.65, label="added to the model")
        left.barh(place[~mine], gains[~mine], color=NOMINAL, height=0.65, label="not added")
        left.set_yticks(place, [label(r.effect) for r in best])
        left.set_xlabel("log evidence that it brings alone [nat]")
        grid(left, "x")
        _errors(right, result, place, colours)
        handles, words = left.get_legend_handles_labels()
        figure.legend(handles, words, loc="outside upper center", ncols=2)
    return figure


def _errors(axes, result: Diagnosis, place, colours) -> None:
    """Mean position error of the geometry with each candidate alone."""
    tried = [i for i, r in enumerate(result.ranking[: len(place)]) if r.held_out_mm is not None]
    rows = "held-out" if result.before.held_out is not None else "fitted"
    without = judged(result.before).position_mm.mean
    for i in tried:
        value = result.ranking[i].held_out_mm
        axes.plot([without, value], [place[i]] * 2, color=colours[i], lw=1.2)
        axes.plot(value, place[i], "o", ms=6, color=colours[i])
        axes.annotate(
            f"{value:.3g}", (value, place[i]), xytext=(-7 if value <= without else 7, 0),
            textcoords="offset points", ha="right" if value <= without else "left", va="center", fontsize=7,
        )  # fmt: skip
    axes.axvline(without, color=COLOURS[0], lw=1.4, ls="--")
    axes.annotate(
        f"geometry alone {without:.3g}", (without, 1.0), xycoords=("data", "axes fraction"), xytext=(3, 2),
        textcoords="offset points", fontsize=7, color=COLOURS[0], ha="center",
    )  # fmt: skip
    axes.set_xlim(0.0, 1.12 * max([without, *(result.ranking[i].held_out_mm or 0.0 for i in tried)]))
    axes.set_xlabel(f"mean error of {rows} rows with it alone [mm]")
    grid(axes, "x")
