"""Figures of errors: nominal arm, geometry alone and with the effects; and residuals in space, as arrows."""

from itertools import islice

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from workbench.data.dataset import Dataset
from workbench.data.prediction import row_components
from workbench.diagnosis.result import Diagnosis
from workbench.extras.reports.apparent_errors import judged_rows
from workbench.identification.report.error_plots import measured
from workbench.report.colours import CALIBRATED, GEOMETRY, NOMINAL
from workbench.report.figures import INK, grid, look, new_figure, plain_ticks
from workbench.report.numbers import short

MODELS = ("nominal", "geometry alone", "with the effects")
SUMMARIES = {"position": "position_mm", "rotation": "orientation_deg", "tilt": "tilt_deg"}
"""Attribute of each kind of error's summary."""
INKS = (NOMINAL, GEOMETRY, CALIBRATED)


def errors(result: Diagnosis) -> Figure:
    """Mean and maximum errors of the three models, and the distribution over rows."""
    kinds = measured(result.after_rows[0])
    with look():
        figure = new_figure(10.0, 2.9 * len(kinds))
        panels = figure.subplots(len(kinds), 2, squeeze=False)
        for line, (rows_name, scale, unit) in zip(panels, kinds, strict=True):
            _means(line[0], result, SUMMARIES[rows_name], unit, rows_name)
            _histogram(line[1], result, rows_name, scale, unit)
    return figure


def _means(axes: Axes, result: Diagnosis, name: str, unit: str, text: str) -> None:
    """Mean (filled) and maximum error (open) on a logarithmic scale."""
    place, ticks, labels = 0.0, [], []
    shown = (result.nominal, result.before, *((result.after,) if result.effects else ()))
    for model, ink, validation in zip(MODELS, INKS, shown, strict=False):
        for rows, found in (("fitted", validation.train), ("held out", validation.held_out)):
            spread = None if found is None else getattr(found, name)
            if spread is None or np.isnan(spread.mean):
                continue
            place -= 1
            mean, maximum = max(spread.mean, 1e-9), max(spread.max, 1e-9)
            axes.plot([mean, maximum], [place] * 2, color=ink, lw=1.4)
            axes.plot(mean, place, "o", ms=7, color=ink)
            axes.plot(maximum, place, "o", ms=5, mfc="none", mec=ink)
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
    axes.set_xlabel(f"{text} error [{unit}]: mean ● and maximum ○")
    plain_ticks(axes.xaxis)
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
    for values, ink, text in islice(drawn, 2 if result.effects else 1):
        axes.hist(values, bins=bins, color=ink, alpha=0.45)
        axes.hist(values, bins=bins, color=ink, histtype="step", lw=1.4, label=text)
    axes.set_xlabel(f"{name} error [{unit}]")
    axes.set_ylabel("rows")
    axes.set_xlim(0.0, 1.05 * top)
    axes.legend(loc="upper right")
    grid(axes, "y")


ARROWS = 250
"""Maximum number of arrows; more are thinned evenly."""
LONGEST = 0.2
"""Length of a long arrow of the geometry, as a share of the measured space."""
ROUND_STEPS = (1, 2, 5)
DARKER = ListedColormap(colormaps["viridis_r"](np.linspace(0.12, 1.0, 256)))
"""Viridis without yellow, which is faint on white."""


def arrows(result: Diagnosis) -> Figure | None:
    """Measured minus predicted position of fitted and held-out rows; None if no positions were measured."""
    fitted = result.after_fit.problem.data
    parts = [fitted, judged_rows(result)]
    robots = (result.before_fit.arm, result.after_fit.arm)
    place = np.concatenate([_positions(p) for p in parts])
    before, after = (
        np.concatenate([row_components(robot, part).position for part in parts]) for robot in robots
    )
    seen = np.flatnonzero(np.isfinite(place).all(1) & np.isfinite(before).all(1))
    if len(seen) < 2:
        return None
    chosen = seen[np.unique(np.linspace(0, len(seen) - 1, min(len(seen), ARROWS)).round().astype(int))]
    place, before, after = place[chosen], before[chosen], after[chosen]
    size = float(np.ptp(place, axis=0).max()) or 1.0
    factor = _round(LONGEST * size / max(float(np.quantile(np.linalg.norm(before, axis=1), 0.9)), 1e-9))
    top = 1e3 * max(float(np.linalg.norm(before, axis=1).max()), 1e-9)
    space = _space(place, before, factor)
    with look():
        figure = new_figure(10.0, 4.6)
        panels = [figure.add_subplot(1, 2, k + 1, projection="3d") for k in range(2)]
        for axes, error, title in zip(
            panels, (before, after), ("geometry alone", "with the effects"), strict=True
        ):
            mean = 1e3 * float(np.linalg.norm(error, axis=1).mean())
            drawn = _field(axes, place, error, factor, top, space)
            axes.set_title(f"{title}: mean {mean:.3g} mm")
        bar = figure.colorbar(drawn, ax=panels, shrink=0.6, pad=0.08)
        bar.set_label(f"error [mm]; arrows {factor:g} × too long")
    return figure


def _positions(data: Dataset) -> np.ndarray:
    return np.full((len(data), 3), np.nan) if data.position is None else data.position


def _round(value: float) -> float:
    """The largest of 1, 2, 5, 10 … that does not exceed the value."""
    power = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(s * power for s in ROUND_STEPS if s * power <= max(value, 1.0)))


def _space(place: np.ndarray, error: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Corner and size of the box that holds points and arrows [m]."""
    ends = np.concatenate([place, place + factor * error])
    low, high = ends.min(0), ends.max(0)
    room = np.maximum(high - low, 0.1 * float((high - low).max()))
    return (low + high - room) / 2, room


def _field(axes, place: np.ndarray, error: np.ndarray, factor: float, top: float, space):
    """Arrows from the measured points, coloured by their length."""
    length = 1e3 * np.linalg.norm(error, axis=1)
    dots = axes.scatter(*place.T, c=length, cmap=DARKER, vmin=0.0, vmax=top, s=7, depthshade=False)
    colours = dots.to_rgba(length)
    tips = factor * error
    axes.quiver(*place.T, *tips.T, colors=np.concatenate([colours, np.repeat(colours, 2, axis=0)]),
                linewidth=1.1, arrow_length_ratio=0.25)  # fmt: skip
    for name, start, size in zip("xyz", *space, strict=True):
        getattr(axes, f"set_{name}lim")(start, start + size)
        getattr(axes, f"set_{name}label")(f"{name} [m]")
        axis = getattr(axes, f"{name}axis")
        axis.set_major_locator(MaxNLocator(4))
        axis.pane.set_edgecolor(INK)
        axis.pane.set_alpha(0.04)
    axes.set_box_aspect(tuple(space[1]), zoom=1.0)
    axes.view_init(elev=22, azim=-56)
    return dots
