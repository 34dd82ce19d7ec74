"""Figures of single rows: before and after, against the noise, and over position and joints."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.identification.errors.row_errors import RowErrors
from workbench.identification.result import Evaluation, Identification
from workbench.report.colours import CALIBRATED, NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure, on_white, plain_ticks

KINDS = (
    ("position", 1e3, "mm"),
    ("rotation", float(np.rad2deg(1.0)), "°"),
    ("tilt", float(np.rad2deg(1.0)), "°"),
)
"""Errors of rows, the factor from SI to the unit in which they are drawn, and that unit."""
MAX_POINTS = 400
"""Maximum number of points in one plot of single rows; more are thinned evenly, which the caption states."""
MAX_GAP = 0.2
"""A gap without rows longer than this share of the range breaks the running median."""


def before_after(result: Identification, place: np.ndarray) -> Figure:
    """Error of every row with the nominal arm and with the best algorithm, on a logarithmic scale."""
    best = result.best
    before, after = _stack(result.nominal_rows), _stack((best.train_rows, best.held_out_rows))
    held = np.arange(len(place)) >= len(result.train_rows)
    kinds = measured(after)
    suspicious = np.zeros(len(place), bool)
    suspicious[best.fit.suspicious] = True
    chosen = _thinned(len(place), keep=suspicious)
    with look():
        figure = new_figure(10.0, 0.8 + 2.1 * len(kinds))
        panels = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, scale, unit) in zip(panels, kinds, strict=True):
            old, new = scale * getattr(before, name)[chosen], scale * getattr(after, name)[chosen]
            _dumbbells(axes, place[chosen], old, new, held[chosen], suspicious[chosen])
            axes.set_ylabel(f"{name} error [{unit}]")
            axes.set_xlim(0.0, len(place) + 1.0)
        panels[-1].set_xlabel("row, in order of measuring")
        panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, markerscale=1.4)
    return figure


def errors_of_rows(result: Evaluation) -> Figure:
    """Error of every row of an evaluation, in the order of the data."""
    shown = measured(result.rows)
    with look():
        figure = new_figure(10.0, 2.5 * len(shown))
        panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, scale, unit) in zip(panels, shown, strict=True):
            values = scale * getattr(result.rows, name)
            axes.plot(result.row_numbers, values, "o", ms=3, color=COLOURS[0], mew=0)
            axes.set_ylabel(f"{name} error [{unit}]")
            axes.set_ylim(0.0, None)
            grid(axes)
        panels[-1].set_xlabel("data row")
    return figure


def _stack(parts: tuple[RowErrors, RowErrors]) -> RowErrors:
    position, rotation, tilt = (np.concatenate([getattr(part, name) for part in parts]) for name, *_ in KINDS)
    return RowErrors(position, rotation, tilt)


def measured(rows: RowErrors) -> list[tuple[str, float, str]]:
    """Those of the kinds that any row has."""
    return [kind for kind in KINDS if np.isfinite(getattr(rows, kind[0])).any()]


def _thinned(rows: int, *, keep: np.ndarray) -> np.ndarray:
    """At most `MAX_POINTS` rows, evenly spread, and those that must be kept."""
    chosen = np.zeros(rows, bool)
    chosen[np.unique(np.linspace(0, rows - 1, min(rows, MAX_POINTS)).round().astype(int))] = True
    return np.flatnonzero(chosen | keep)


def _dumbbells(axes: Axes, x, old, new, held, suspicious) -> None:
    floor = max(float(np.nanmax(np.concatenate([old, new]), initial=0.0)), 1e-9) * 1e-9
    old, new = np.maximum(old, floor), np.maximum(new, floor)
    axes.set_yscale("log")
    axes.vlines(x, new, old, color=NOMINAL, lw=0.5, alpha=0.6)
    size = 3.0 if len(x) <= 150 else 2.0
    axes.plot(x, old, "o", ms=size, color=NOMINAL, mew=0, label="nominal")
    axes.plot(x[~held], new[~held], "o", ms=size, color=CALIBRATED, mew=0, label="identified, fitted rows")
    if held.any():
        axes.plot(x[held], new[held], "o", ms=size, color=INK, mew=0, label="identified, held-out rows")
    if suspicious.any():
        axes.plot(x[suspicious], new[suspicious], "o", ms=8, mfc="none", mec=COLOURS[3], label="stands out")
    plain_ticks(axes.yaxis)
    grid(axes)


def evaluation_figure(result: Evaluation) -> Figure:
    return on_white(errors_of_rows(result))
