"""Picture of the residuals in space: measured points with exaggerated arrows, before and after."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from workbench.data.dataset import Dataset
from workbench.data.prediction import row_components
from workbench.diagnosis.record import Diagnosis
from workbench.diagnosis.report.apparent import judged_rows
from workbench.report.drawing import INK, look, new_figure

ARROWS = 250
"""Most arrows; more are thinned evenly."""
LONGEST = 0.2
"""Length of a long arrow before, as a share of the measured space."""
STEPS = (1, 2, 5)
DARKER = ListedColormap(colormaps["viridis_r"](np.linspace(0.12, 1.0, 256)))
"""Viridis without the yellow that fades on white."""


def arrows(result: Diagnosis) -> Figure | None:
    """Measured minus predicted position of fitted and held-out rows; None if no positions were measured."""
    fitted = result.after_fit.problem.data
    parts = [fitted, judged_rows(result)]
    robots = (result.before_fit.calibrated, result.calibrated)
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
    """The greatest of 1, 2, 5, 10 … that is not above."""
    power = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(s * power for s in STEPS if s * power <= max(value, 1.0)))


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
