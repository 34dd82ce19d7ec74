"""The paper's array of error plots: rows X, Y, Z and norm, columns NOM, OLS, OPT1, OPT2 (ARIA Figs. 7, 11).

Within a row of the array the identified arms share one scale, so that they can be compared. The nominal arm's
errors are often a hundred times larger: its column then has a separate scale with the ratio noted, and the
range of the other columns is shaded.
"""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.identification.result import ArmErrors
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

STEMS = 200
"""Maximum number of measurements that are drawn one by one."""
OWN_SCALE = 3.0
"""The nominal column gets a separate scale if its errors exceed the others' by this factor."""
LABELS = ("X", "Y", "Z", "norm")


def error_grid(
    columns: tuple[ArmErrors, ...], place: np.ndarray, *, rotation: bool, limit: float | None = None
) -> Figure | None:
    """The array of plots.

    Args:
        columns: The nominal arm first.
        place: Place along l of every training and then every held-out row.
        rotation: Orientation errors e_ρ [°] instead of position errors e_p [mm].
        limit: Required error per axis [mm or °], drawn where it fits.

    Returns:
        The figure with 4 × columns axes; None if no row has such errors.
    """
    scale = np.rad2deg(1.0) if rotation else 1e3
    tables = [_table(c, rotation) * scale for c in columns]
    if not np.isfinite(tables[0]).any():
        return None
    held = np.arange(len(place)) >= len(columns[0].train)
    unit = "°" if rotation else "mm"
    with look():
        figure = new_figure(2.0 + 2.0 * len(columns), 7.0)
        axes = figure.subplots(4, len(columns), sharex=True, squeeze=False)
        for i, label in enumerate(LABELS):
            spans = [_span(table[:, i]) for table in tables]
            common = max(spans[1:], default=spans[0])
            own = spans[0] > OWN_SCALE * common
            for j, table in enumerate(tables):
                span = spans[0] if j == 0 and own else max(common, spans[0] * (not own))
                colour = NOMINAL if j == 0 else COLOURS[(j - 1) % len(COLOURS)]
                _draw(axes[i, j], table[:, i], place, held, colour)
                _scale(axes[i, j], span, signed=i < 3)
                if limit is not None and i < 3 and limit < span:
                    axes[i, j].hlines([-limit, limit], *_x_range(place), color=INK, ls=(0, (1, 2)), lw=0.9)
                if j == 0 and own:
                    axes[i, j].axhspan(-common if i < 3 else 0.0, common, color=COLOURS[0], alpha=0.18, lw=0)
                    _say(axes[i, j], f"scale 1 : {_round(spans[0] / common)}")
                if j > 1:
                    axes[i, j].tick_params(labelleft=False)
            axes[i, 0].set_ylabel(f"{label} [{unit}]")
        for j, column in enumerate(columns):
            axes[0, j].set_title(column.title)
            axes[3, j].set_xlabel("measurement l" if len(place) <= STEMS else "share of rows, sorted [%]")
        _legend(figure, held, len(place))
    return figure


def _table(column: ArmErrors, rotation: bool) -> Float[np.ndarray, "rows 4"]:
    parts = [c.rotation if rotation else c.position for c in (column.train, column.held_out)]
    errors = np.concatenate(parts)
    return np.column_stack([errors, np.linalg.norm(errors, axis=1)])


def _span(errors: np.ndarray) -> float:
    finite = np.abs(errors[np.isfinite(errors)])
    return max(1.08 * float(finite.max(initial=0.0)), 1e-12)


def _draw(axes: Axes, errors: np.ndarray, place: np.ndarray, held: np.ndarray, colour: str) -> None:
    grid(axes)
    axes.axhline(0.0, color=INK, lw=0.5)
    for mine, ink in ((~held, colour), (held, INK)):
        chosen = mine & np.isfinite(errors)
        if not chosen.any():
            continue
        if len(place) <= STEMS:
            axes.vlines(place[chosen], 0.0, errors[chosen], color=ink, lw=2.2 if len(place) <= 40 else 1.0)
            if len(place) <= 60:
                axes.plot(place[chosen], errors[chosen], "o", ms=2.6, color=ink, mew=0)
        else:
            share = np.linspace(0.0, 100.0, STEMS + 1)
            curve = np.percentile(errors[chosen], share)
            dashed = mine is held
            axes.plot(share, curve, color=ink, ls=(0, (3, 2)) if dashed else "-")
            if not dashed:
                axes.fill_between(share, 0.0, curve, color=ink, alpha=0.25, lw=0)
    axes.set_xlim(*_x_range(place))
    axes.locator_params(axis="x", integer=True)


def _x_range(place: np.ndarray) -> tuple[float, float]:
    return (0.0, 100.0) if len(place) > STEMS else (0.25, len(place) + 0.75)


def _scale(axes: Axes, span: float, *, signed: bool) -> None:
    axes.set_ylim(-span if signed else 0.0, span)
    axes.locator_params(axis="y", nbins=5)


def _say(axes: Axes, text: str) -> None:
    axes.set_title(text, loc="right", fontsize=6.5, fontweight="normal", pad=2.0, alpha=0.85)


def _round(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio < 1e4 else f"{ratio:.0e}"


def _legend(figure: Figure, held: np.ndarray, rows: int) -> None:
    if not held.any():
        return
    what = "dashed" if rows > STEMS else "colour of the text"
    text = f"colour: {rows - held.sum()} fitted rows;   {what}: {held.sum()} held-out rows"
    figure.supxlabel(text, fontsize=7.5)
