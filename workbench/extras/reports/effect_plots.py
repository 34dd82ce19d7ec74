"""Figures of effects: against their drivers, and errors of joints against the joint's own position.

The constant part of a joint's error is its zero and belongs to the geometry, so it is removed:

    y(q) = (b(q) − b̄)ᵀ c,      std² = (b − b̄)ᵀ C (b − b̄)

with b the laws of all effects of one joint's own position, b̄ their mean over the rows and C their part of
the covariance.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.axes import turns
from workbench.arm.effects.law import NO_WRENCHES
from workbench.arm.effects.plots import IncrementCurve
from workbench.arm.motion import Motion
from workbench.diagnosis.result import Accepted, Diagnosis
from workbench.extras.reports.apparent_errors import FinalRows
from workbench.identification.report.error_plots import MAX_POINTS
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

BINS = 14
"""Maximum number of bins of a running mean."""
MIN_ROWS_PER_BIN = 3
"""Minimum number of rows in a bin."""
BEYOND = 1.35
"""Margin of the axis beyond nearly all rows."""
DIM = 0.15
"""Weight relative to the best rows' below which a row is not drawn."""


def against_drivers(found: Accepted, rows: FinalRows) -> Figure:
    """Rows over the effect's driver, on the left with the effect removed, on the right with it."""
    shown = found.effect.sized(rows.robot.coefficients).views(rows.state)
    with look():
        figure = new_figure(10.0, 2.9 * len(shown) + 0.35)
        panels = figure.subplots(len(shown), 2, sharey="row", sharex="row", squeeze=False)
        for line, view in zip(panels, shown, strict=True):
            _pair(line, view, rows)
        panels[0, 0].set_title("without this effect")
        panels[0, 1].set_title("with this effect")
        handles, text = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, text, loc="outside upper center", ncols=4)
    return figure


def _pair(line, view: IncrementCurve, rows: FinalRows) -> None:
    left, std = rows.along(view.elements, view.direction)
    weight = 1.0 / std**2
    before, after = view.scale * (left + view.law), view.scale * left
    x = view.x + (_spread(len(view.x)) if view.steps else 0.0)
    for axes, values, law in zip(line, (before, after), (view.scale * view.law, 0.0 * view.law), strict=True):
        axes.axhline(0.0, color=INK, lw=0.6)
        _points(axes, x, values, weight, rows.held_out)
        _means(axes, view, after, law, weight)
        axes.set_xlabel(view.driver)
        grid(axes, "both")
    _curve(line[0], view)
    line[0].set_ylabel(view.what)
    line[1].tick_params(labelleft=False)
    line[0].set_ylim(*_limits(before, weight))
    if view.steps:
        line[0].set_xticks([-1, 0, 1], ["backwards (−)", "none yet", "forwards (+)"])


def _spread(count: int) -> np.ndarray:
    """Reproducible jitter that separates rows of the same value."""
    return 0.18 * (np.random.default_rng(0).random(count) - 0.5)


def _points(axes: Axes, x, values, weight, held) -> None:
    """Rows; those with little information on the increment are faint."""
    weighty = np.flatnonzero(weight > DIM * np.median(weight))
    chosen = weighty[
        np.unique(np.linspace(0, len(weighty) - 1, min(len(weighty), MAX_POINTS)).round().astype(int))
    ]
    for mine, colour, marker, text in (
        (~held, COLOURS[0], "o", "fitted rows"),
        (held, COLOURS[2], "D", "held-out rows"),
    ):
        part = chosen[mine[chosen]]
        if len(part):
            axes.plot(x[part], values[part], marker, ms=3.8, color=colour, alpha=0.65, mew=0, label=text)


def _means(axes: Axes, view: IncrementCurve, values, law, weight) -> None:
    """Weighted means of the residuals in bins with their standard errors, added to the law at the bin's
    centre."""
    if view.steps:
        edges = np.array([-1.5, -0.5, 0.5, 1.5])
    else:
        count = int(np.clip(len(values) // 7, 1, BINS))
        edges = np.linspace(view.x.min(), np.nextafter(view.x.max(), np.inf), count + 1)
    place = np.digitize(view.x, edges) - 1
    centre, mean, error = [], [], []
    for k in range(len(edges) - 1):
        mine = place == k
        if mine.sum() < MIN_ROWS_PER_BIN:
            continue
        w = weight[mine] / weight[mine].sum()
        m, middle = float(w @ values[mine]), float(w @ view.x[mine])
        centre.append(middle)
        mean.append(m + float(law[np.argmin(np.abs(view.x - middle))]))
        error.append(float(np.sqrt((w**2) @ (values[mine] - m) ** 2)))
    axes.errorbar(
        centre, mean, yerr=error, fmt="s", ms=4.5, color=INK, capsize=2, elinewidth=1.0, zorder=4,
        label="mean ± its error",
    )  # fmt: skip


def _curve(axes: Axes, view: IncrementCurve) -> None:
    x, y = view.curve
    if view.steps:
        for side in (-1.0, 1.0):
            here = view.x == side
            if here.any():
                level = view.scale * float(view.law[here][0])
                text = "identified law" if side < 0 else None
                axes.plot([side - 0.35, side + 0.35], [level] * 2, color=COLOURS[1], lw=2.2, label=text)
        return
    axes.plot(x, view.scale * y, color=COLOURS[1], lw=2.0, label="identified law", zorder=3)


def _limits(values: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """A range about zero that holds nearly all informative rows."""
    weighty = values[weight > DIM * np.median(weight)]
    low, high = np.quantile(weighty, [0.01, 0.99]) if len(weighty) else (0.0, 0.0)
    reach = max(BEYOND * max(abs(float(low)), abs(float(high))), 1e-12)
    return -reach, reach


GRID = 800
COLUMNS = 2
BAND_ERRORS = 2.0
"""Half-width of the band in standard errors."""


def mapped(result: Diagnosis) -> dict[int, list[AbstractEffect]]:
    """Accepted errors of joints over their own position, by joint."""
    found: dict[int, list[AbstractEffect]] = {}
    for accepted in result.effects:
        if accepted.effect.maps_joint:
            for joint in accepted.effect.joints:
                found.setdefault(joint, []).append(accepted.effect)
    return dict(sorted(found.items()))


def shapes(result: Diagnosis) -> Figure | None:
    """One panel for every joint with a position-dependent error; None if there is none."""
    joints = mapped(result)
    if not joints:
        return None
    columns = min(COLUMNS, len(joints))
    lines = -(-len(joints) // columns)
    with look():
        figure = new_figure(10.0, 2.8 * lines + 0.3)
        panels = figure.subplots(lines, columns, squeeze=False).ravel()
        for axes, (joint, effects) in zip(panels, joints.items(), strict=False):
            _shape(axes, result, joint, effects)
        for axes in panels[len(joints) :]:
            axes.set_visible(False)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def _shape(axes: Axes, result: Diagnosis, joint: int, effects: list[AbstractEffect]) -> None:
    fit = result.after_fit
    chain = result.calibrated.chain
    q = fit.problem.data.q[:, joint]
    grid_q = np.linspace(q.min(), q.max(), GRID)
    basis = np.hstack([_basis(e, chain, grid_q, joint) for e in effects])
    basis -= np.hstack([_basis(e, chain, q, joint) for e in effects]).mean(0)
    names = [n for e in effects for n in e.names]
    places = [fit.problem.names.index(n) for n in names]
    shape = 1e3 * basis @ fit.x[places]
    variance = np.einsum("gi,ij,gj->g", basis, fit.covariance[np.ix_(places, places)], basis)
    std = 1e3 * np.sqrt(np.maximum(variance, 0.0))
    scale, unit = (float(np.rad2deg(1.0)), "°") if turns(chain, joint) else (1e3, "mm")
    x = scale * grid_q
    axes.fill_between(
        x, shape - BAND_ERRORS * std, shape + BAND_ERRORS * std, color=COLOURS[4], alpha=0.45, lw=0,
        label=f"± {BAND_ERRORS:g} standard errors",
    )  # fmt: skip
    axes.plot(x, shape, color=COLOURS[1], lw=1.8, label="error of the joint")
    axes.axhline(0.0, color=INK, lw=0.6)
    low = float(min((shape - BAND_ERRORS * std).min(), 0.0))
    height = max(float((shape + BAND_ERRORS * std).max()) - low, 1e-12)
    axes.plot(
        scale * q, np.full(len(q), low - 0.08 * height), "|", color=INK, ms=5, mew=0.5, label="measured there"
    )
    axes.set_title(f"joint {joint + 1}")
    axes.set_xlabel(f"{'angle' if unit == '°' else 'position'} of joint {joint + 1} [{unit}]")
    axes.set_ylabel(f"error [{'mrad' if unit == '°' else 'mm'}]")
    grid(axes, "both")


def _basis(effect: AbstractEffect, chain, q: np.ndarray, joint: int) -> np.ndarray:
    """Error of one joint per unit of every coefficient."""
    motion = Motion(np.repeat(q[:, None], chain.dof, axis=1))
    place = effect.joints.index(joint)
    return effect.law(chain, motion, NO_WRENCHES)[:, place]
