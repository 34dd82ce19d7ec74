"""Joints, speeds, torques and moments along a path, drawn as in Katana figs. 5.7 to 5.9."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D

from workbench.arm.joint_units import shown_joints, sliding
from workbench.arm.statics.moments import JointMoments
from workbench.extras.trajectories.planning import Planned
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure, png


def path_picture(planned: Planned, moments: JointMoments | None) -> bytes:
    """Joints and speeds, with torques and moments across the axes below, as a PNG file."""
    with look():
        figure = new_figure(10.0, 3.0 if moments is None else 6.0)
        parts = figure.subfigures(1 if moments is None else 2, 1, squeeze=False)[:, 0]
        draw_motion(parts[0], planned)
        if moments is not None:
            draw_moments(parts[1], planned, moments)
    return png(figure)


def draw_motion(figure: FigureBase, planned: Planned) -> None:
    """Joints and velocities over time (Katana fig. 5.7)."""
    unit = "° or mm" if sliding(planned.robot).any() else "°"
    rows = ((planned.q, unit), (planned.motion.velocity, f"{unit}/s"))
    for axes, (values, text) in zip(figure.subplots(1, 2), rows, strict=True):
        _curves(axes, planned, shown_joints(planned.robot, np.asarray(values)), text)
    _legend(figure, planned)


def draw_moments(figure: FigureBase, planned: Planned, moments: JointMoments) -> None:
    """Torques about the axes, and moments across them, over time (Katana figs. 5.8, 5.9)."""
    about = ("about the joint's axis", moments.about)
    sides = ((f"across it, about {side}", moments.across[:, :, i]) for i, side in enumerate("xy"))
    for axes, (title, values) in zip(figure.subplots(1, 3, sharey=True), (about, *sides), strict=True):
        axes.axhline(0.0, color=INK, lw=0.6, zorder=0)
        _curves(axes, planned, values, "N m")
        axes.set_title(title)
    _legend(figure, planned)


def _curves(axes: Axes, planned: Planned, values: np.ndarray, unit: str) -> None:
    for j, column in enumerate(values.T):
        axes.plot(planned.time, column, color=_colour(j), ls=_style(j))
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"[{unit}]")
    grid(axes)


def _legend(figure: FigureBase, planned: Planned) -> None:
    names = [f"joint {j + 1}" for j in range(planned.robot.dof)]
    handles = [Line2D([], [], color=_colour(j), ls=_style(j)) for j in range(len(names))]
    figure.legend(handles, names, loc="outside lower center", ncols=len(names))


def _colour(joint: int) -> str:
    return (*COLOURS, NOMINAL)[joint % (len(COLOURS) + 1)]


def _style(joint: int) -> str:
    return "-" if joint <= len(COLOURS) else "--"
