"""Error map of a verified arm over its workspace, and the distribution of its errors."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from workbench.base import se3
from workbench.data.prediction import predict
from workbench.extras.service.verification.result import Verification
from workbench.report.figures import COLOURS, INK, grid, look, new_figure, on_white

CAPTION = (
    "Left and middle: every fresh pose, in the robot's base frame, from above and from the side; the darker, "
    "the larger its position error (its largest entry where the limit is one per axis). Right: share "
    "of measurements below an error; dashed: the required error."
)
MAX_DRAWN_POSES = 2000
"""Poses that are drawn one by one; of more, the worst and every so many of the others."""


def error_map(result: Verification) -> Figure:
    """Two views of the work space and the distribution of the errors."""
    errors, places = 1e3 * result.judged_positions, _places(result)
    order = np.argsort(errors)
    if len(order) > MAX_DRAWN_POSES:
        order = np.union1d(order[:: -(-len(order) // MAX_DRAWN_POSES)], order[-MAX_DRAWN_POSES // 10 :])
        order = order[np.argsort(errors[order])]
    top = max(float(errors.max()), 1e-9)
    if result.wanted is not None:
        top = max(top, 1e3 * result.wanted.position)
    with look():
        figure = new_figure(9.6, 3.1)
        axes = figure.subplots(1, 3, width_ratios=[1.0, 1.15, 1.05])
        for panel, (i, j) in zip(axes, ((0, 1), (0, 2)), strict=False):
            dots = panel.scatter(
                *(1e3 * places[order][:, [i, j]]).T,
                c=errors[order],
                s=float(np.clip(1500 / len(order), 5, 26)),
                cmap="viridis_r",
                vmin=0.0,
                vmax=top,
                linewidths=0.3,
                edgecolors=INK,
            )
            _frame(panel, i, j)
        _scale(figure, axes[1], dots, result)
        _distribution(axes[2], errors, result)
    return figure


def _places(result: Verification) -> Float[np.ndarray, "rows 3"]:
    """Where the model expects the tool, in the robot's base frame [m]."""
    poses, data = predict(result.robot, result.data), result.data
    for session in data.sessions:
        rows = data.in_session(session)
        poses[rows] = se3.inverse(result.robot.in_session(session).base.pose) @ poses[rows]
    return poses[:, :3, 3]


def _frame(axes: Axes, i: int, j: int) -> None:
    axes.plot(0.0, 0.0, "+", color=INK, ms=9)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"{'xyz'[i]} [mm]")
    axes.set_ylabel(f"{'xyz'[j]} [mm]")
    axes.locator_params(nbins=5)
    axes.set_title("from above" if j == 1 else "from the side")
    grid(axes, "both")


def _scale(figure: Figure, axes: Axes, dots: PathCollection, result: Verification) -> None:
    bar = figure.colorbar(dots, ax=axes, shrink=0.8, aspect=25, pad=0.03)
    bar.outline.set_linewidth(0.4)  # type: ignore[operator]
    bar.ax.tick_params(labelsize=6)
    bar.ax.set_title("mm", fontsize=6, fontweight="normal")
    if result.wanted is not None:
        bar.ax.axhline(1e3 * result.wanted.position, color=INK, lw=1.2)


def _distribution(axes: Axes, errors: Float[np.ndarray, " rows"], result: Verification) -> None:
    share = 100.0 * np.arange(1, len(errors) + 1) / len(errors)
    axes.step(np.concatenate([[0.0], np.sort(errors)]), np.concatenate([[0.0], share]), color=COLOURS[0])
    if result.wanted is not None:
        axes.axvline(1e3 * result.wanted.position, color=INK, lw=0.9, ls=(0, (3, 2)))
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, 103.0)
    is_entry = result.wanted is not None and result.wanted.per_axis
    axes.set_xlabel("position error, largest axis [mm]" if is_entry else "position error [mm]")
    axes.set_ylabel("measurements below [%]")
    axes.set_title("distribution")
    grid(axes, "both")


def error_figure(result: Verification) -> Figure:
    """Where in the work space the errors are, and how large."""
    return on_white(error_map(result))
