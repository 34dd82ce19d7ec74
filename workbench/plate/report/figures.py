"""Figures of plates: information per target of a scored plate, and a designed plate from above."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from workbench.base import se3
from workbench.plate.optimiser.result import PlateDesign
from workbench.plate.plate import Plate
from workbench.plate.plate_score import PlateScore
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure, on_white

SHARES = "share of I [%]"


def score_figure(score: PlateScore) -> Figure:
    """O and share of the index I target by target, and the errors predicted over the region."""
    chosen, place = score.measured, np.arange(1, len(score.plate) + 1)
    with look():
        figure = new_figure(10.0, 2.9)
        left, middle, right = figure.subplots(1, 3)
        left.bar(place, chosen.per_target, color=COLOURS[0], width=0.7)
        left.set_ylabel("O of each target")
        middle.bar(place, 100.0 * chosen.shares, color=COLOURS[2], width=0.7)
        middle.set_ylabel(SHARES)
        for axes in (left, middle):
            axes.set_xlabel("target")
            axes.set_xticks(place)
            grid(axes)
        _predicted(right, score)
    return on_white(figure)


def _predicted(axes: Axes, score: PlateScore) -> None:
    """Predicted position errors of the poses in the region, in the targets' branches and with one."""
    sets = [("the targets' branches", score.measured, COLOURS[0])]
    if score.single is not None:
        sets.append(("one branch", score.single, NOMINAL))
    for text, chosen, colour in sets:
        errors = 1e3 * np.sort(chosen.error.position[np.isfinite(chosen.error.position)])
        share = 100.0 * np.arange(1, len(errors) + 1) / max(len(errors), 1)
        axes.plot(errors, share, color=colour, label=text)
    axes.set_xlim(0.0, None)
    axes.set_xlabel("predicted position error in the region [mm]")
    axes.set_ylabel("poses with less [%]")
    axes.legend(loc="lower right")
    grid(axes, "both")


def design_figure(design: PlateDesign) -> Figure:
    """The plate from above with its targets and their tilts, and the criterion after every round."""
    with look():
        figure = new_figure(10.0, 3.9)
        left, right = figure.subplots(1, 2)
        _from_above(left, design.plate)
        right.plot(1e3 * np.array(design.history), color=COLOURS[0], marker="o", ms=3, label="optimised")
        if np.isfinite(design.start_cost):
            right.axhline(1e3 * design.start_cost, color=NOMINAL, ls="--", label="the given plate")
        right.axhline(1e3 * design.cost, color=COLOURS[2], lw=0.8, label="in the region, final")
        right.set_ylim(0.0, None)
        right.set_xlabel("round of the search")
        right.set_ylabel("predicted position error, rms [mm]")
        right.legend(loc="upper right")
        grid(right)
    return on_white(figure)


def _from_above(axes: Axes, plate: Plate) -> None:
    """Targets as points, the probe's retreat as a stroke, in the plate's own axes."""
    if plate.size is not None:
        length, width = 1e3 * plate.size[:2]
        axes.add_patch(Rectangle((-length / 2, -width / 2), length, width, fill=False, ec=INK, lw=0.8))
    local = se3.inverse(plate.pose) @ plate.poses
    places, back = 1e3 * local[:, :2, 3], -60.0 * local[:, :2, 2]
    axes.quiver(*places.T, *back.T, angles="xy", scale_units="xy", scale=1.0, width=0.004, color=NOMINAL)
    axes.plot(*places.T, "o", ms=5, color=COLOURS[0], mew=0)
    for number, place in enumerate(places, 1):
        axes.annotate(str(number), place, xytext=(4, 4), textcoords="offset points", fontsize=7)
    axes.set_aspect("equal")
    axes.set_xlabel("x on the plate [mm]")
    axes.set_ylabel("y [mm]")
    axes.set_title(plate.name)
    grid(axes, "both")
