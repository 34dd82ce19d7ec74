"""Picture of the errors: nominal arm, geometry alone, with the effects; on fitted and on held-out rows."""

from itertools import islice

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.diagnosis.record import Diagnosis
from workbench.report.drawing import (
    COLOURS,
    NOMINAL,
    grid,
    look,
    new_figure,
)
from workbench.report.numbers import short

MODELS = ("nominal", "geometry alone", "with the effects")
INKS = (NOMINAL, COLOURS[0], COLOURS[1])


def errors(result: Diagnosis) -> Figure:
    """Means and greatest errors of the three models, and how the errors of single rows are spread."""
    turned = result.after.train.orientation_deg is not None
    kinds = [("position", "position_mm", 1e3, "mm")]
    if turned:
        kinds.append(("rotation", "orientation_deg", float(np.rad2deg(1.0)), "°"))
    with look():
        figure = new_figure(10.0, 2.9 * len(kinds))
        panels = figure.subplots(len(kinds), 2, squeeze=False)
        for line, (rows_name, name, scale, unit) in zip(panels, kinds, strict=True):
            _means(line[0], result, name, unit, rows_name)
            _histogram(line[1], result, rows_name, scale, unit)
    return figure


def _means(axes: Axes, result: Diagnosis, name: str, unit: str, words: str) -> None:
    """Mean (filled) and greatest error (open) on a logarithmic scale."""
    place, ticks, labels = 0.0, [], []
    shown = (result.nominal, result.before, *((result.after,) if result.effects else ()))
    for model, ink, validation in zip(MODELS, INKS, shown, strict=False):
        for rows, found in (("fitted", validation.train), ("held out", validation.held_out)):
            spread = None if found is None else getattr(found, name)
            if spread is None:
                continue
            place -= 1
            mean, most = max(spread.mean, 1e-9), max(spread.max, 1e-9)
            axes.plot([mean, most], [place] * 2, color=ink, lw=1.4)
            axes.plot(mean, place, "o", ms=7, color=ink)
            axes.plot(most, place, "o", ms=5, mfc="none", mec=ink)
            axes.annotate(
                short(spread.mean), (mean, place), xytext=(0, 6), textcoords="offset points", ha="center",
                fontsize=7.5, fontweight="bold",
            )  # fmt: skip
            ticks.append(place)
            labels.append(f"{model}, {rows}")
        place -= 0.4
    axes.set_xscale("log")
    axes.set_yticks(ticks, labels)
    axes.set_ylim(place - 0.3, 0.0)
    axes.set_xlabel(f"{words} error [{unit}]: mean ● and greatest ○")
    axes.xaxis.set_major_formatter("{x:g}")
    grid(axes, "x")


def _histogram(axes: Axes, result: Diagnosis, name: str, scale: float, unit: str) -> None:
    """Errors of single rows before and after, fitted and held-out ones together."""
    before, after = (
        scale * np.concatenate([getattr(part, name) for part in rows])
        for rows in (result.before_rows, result.after_rows)
    )
    before, after = before[np.isfinite(before)], after[np.isfinite(after)]
    top = max(float(np.quantile(before, 0.995, method="higher")), float(np.quantile(after, 0.995)), 1e-9)
    count = int(np.clip(np.sqrt(len(before)) * 2.5, 12, 60))
    bins = np.linspace(0.0, 1.05 * top, count).tolist()
    drawn = zip((before, after), INKS[1:], MODELS[1:], strict=True)
    for values, ink, words in islice(drawn, 2 if result.effects else 1):
        axes.hist(values, bins=bins, color=ink, alpha=0.45)
        axes.hist(values, bins=bins, color=ink, histtype="step", lw=1.4, label=words)
    axes.set_xlabel(f"{name} error [{unit}]")
    axes.set_ylabel("rows")
    axes.set_xlim(0.0, 1.05 * top)
    axes.legend(loc="upper right")
    grid(axes, "y")
