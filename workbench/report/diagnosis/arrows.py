"""Picture of the residuals in space: measured points with exaggerated arrows, before and after."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from workbench.diagnose.record import Diagnosis
from workbench.measure.dataset import Dataset
from workbench.report.drawing import COLOURS, INK, look, new_figure
from workbench.validate.components import row_components

ARROWS = 250
"""Most arrows; more are thinned evenly."""
LONGEST = 0.16
"""Length of a long arrow before, as a share of the measured space."""
STEPS = (1, 2, 5)


def arrows(result: Diagnosis) -> Figure | None:
    """Measured minus predicted position of fitted and held-out rows; None if no positions were measured."""
    fitted = result.after_fit.problem.data
    parts = [fitted, result.held_out_data]
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
    with look():
        figure = new_figure(10.0, 5.2)
        panels = [figure.add_subplot(1, 2, k + 1, projection="3d") for k in range(2)]
        for axes, error, title in zip(panels, (before, after), ("geometry alone", "with the effects"), strict=True):
            mean = 1e3 * float(np.linalg.norm(error, axis=1).mean())
            drawn = _field(axes, place, error, factor, top)
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


def _field(axes, place: np.ndarray, error: np.ndarray, factor: float, top: float):
    """Arrows from the measured points, coloured by their length."""
    from matplotlib.collections import PathCollection

    length = 1e3 * np.linalg.norm(error, axis=1)
    dots: PathCollection = axes.scatter(
        *place.T, c=length, cmap="viridis_r", vmin=0.0, vmax=top, s=7, depthshade=False
    )
    colours = dots.to_rgba(length)
    tips = factor * error
    axes.quiver(*place.T, *tips.T, colors=np.concatenate([colours, np.repeat(colours, 2, axis=0)]),
                linewidth=1.1, arrow_length_ratio=0.25)  # fmt: skip
    middle, half = (place.max(0) + place.min(0)) / 2, 0.58 * float(np.ptp(place, axis=0).max())
    for name, m in zip("xyz", middle, strict=True):
        getattr(axes, f"set_{name}lim")(m - half, m + half)
        getattr(axes, f"set_{name}label")(f"{name} [m]")
        axis = getattr(axes, f"{name}axis")
        axis.set_major_locator(MaxNLocator(4))
        axis.pane.set_edgecolor(INK)
        axis.pane.set_alpha(0.04)
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=22, azim=-56)
    return dots
