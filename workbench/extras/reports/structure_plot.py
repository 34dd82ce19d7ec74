"""Figure of the residuals, over the axis with structure, or in the order of the rows."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.arm.effects.events import AbstractEvent
from workbench.arm.motion import Motion
from workbench.diagnosis.claims.structure import IN_ORDER
from workbench.diagnosis.result import Diagnosis
from workbench.extras.reports.diagnosis_errors import INKS, MODELS
from workbench.identification.report.error_plots import measured
from workbench.report.colours import EVENT
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

NEIGHBOURS = 9
"""Number of rows in a running mean."""
MAX_SESSIONS = 20
"""Maximum number of sessions marked."""


def along_axis(result: Diagnosis) -> Figure | None:
    """One panel per component; None with too few rows for a test."""
    found = result.structure
    if found.shown is None:
        return None
    axis, x = found.shown, found.shown.value
    order = np.argsort(x, kind="stable")
    with look():
        figure = new_figure(10.0, 1.0 + 1.7 * len(found.residual))
        panels = figure.subplots(len(found.residual), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, values) in zip(panels, found.residual.items(), strict=True):
            axes.axhline(0.0, color=INK, lw=0.6)
            axes.plot(x, values, "o", ms=3.5, color=COLOURS[0], alpha=0.6, mew=0)
            axes.plot(*(_running(v[order]) for v in (x, values)), color=COLOURS[1], lw=1.8)
            axes.set_ylabel(name)
            if axis.name in IN_ORDER:
                _mark(axes, result.events)
                _divide(axes, result, x)
            grid(axes, "both")
        panels[-1].set_xlabel(axis.label)
    return figure


def row_by_row(result: Diagnosis) -> Figure | None:
    """Error of every row in measuring order, with events; None without events."""
    events = result.events
    kinds = measured(result.after_rows[0])
    if not events or not kinds:
        return None
    name, scale, unit = kinds[0]
    fits = ((result.before_fit, result.before_rows[0]), (result.after_fit, result.after_rows[0]))
    with look():
        figure = new_figure(10.0, 2.9)
        axes = figure.subplots()
        for (fit, rows), ink, text in zip(fits, INKS[1:], MODELS[1:], strict=True):
            clock = events[0].clock(Motion.of(fit.problem.data))
            if clock is None:
                return None
            minutes = clock / (60.0 if events[0].is_timed else 1.0)
            axes.plot(minutes, scale * getattr(rows, name), "o", ms=3.5, color=ink, mew=0, label=text)
        _mark(axes, events)
        axes.set_xlabel("time [min]" if events[0].is_timed else "row of the file")
        axes.set_ylabel(f"{name} error [{unit}]")
        axes.set_ylim(0.0, None)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        grid(axes, "both")
    return figure


def _mark(axes: Axes, events: Sequence[AbstractEvent]) -> None:
    """Dashed lines at events, with their names above."""
    for k, event in enumerate(events):
        at = event.moment / (60.0 if event.is_timed else 1.0)
        axes.axvline(at, color=EVENT, ls="--", lw=1.2)
        axes.text(
            at, 0.97 - 0.1 * k, f" {event.mark}", va="top", fontsize=7.5, transform=axes.get_xaxis_transform()
        )


def _divide(axes: Axes, result: Diagnosis, x: np.ndarray) -> None:
    """Dotted lines between consecutive sessions, and their names beneath."""
    data = result.data
    if data.session is None:
        return
    order = np.argsort(x, kind="stable")
    names = dict(zip(np.asarray(data.row).tolist(), np.asarray(data.session).tolist(), strict=True))
    session = np.array([names[r] for r in result.structure.row[order].tolist()])
    changes = np.flatnonzero(session[1:] != session[:-1]) + 1
    if not 0 < len(changes) < MAX_SESSIONS:
        return
    for first in (0, *changes.tolist()):
        at = x[order][first]
        if first:
            axes.axvline(at, color=INK, ls=":", lw=1.0)
        axes.text(
            at, 0.03, f" {session[first]}", va="bottom", fontsize=7.5, transform=axes.get_xaxis_transform()
        )


def _running(values: np.ndarray) -> np.ndarray:
    """Running means."""
    count = min(NEIGHBOURS, len(values))
    return np.convolve(values, np.full(count, 1.0 / count), mode="valid")
