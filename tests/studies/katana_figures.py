"""Pictures of the Katana thesis done again: influences (Fig. 3.8), poses (Fig. 4.8), errors of many arms."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.influence_study import study_figure
from studies.katana import KatanaReproduction
from studies.katana_printed import PRINTED_INFLUENCE, TABLE_3_4, TABLE_4_5, TABLE_4_6_MEANS
from studies.katana_study import TITLES, KatanaStudy
from studies.page import Picture, drawn
from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.identification.report.constants import influence_figure
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

PRINTED = (
    (TABLE_3_4[3, 0], *TABLE_3_4[3, 1:], np.nan, *TABLE_4_5[2, 3, 1:], np.nan),
    (TABLE_4_6_MEANS[0], np.nan, np.nan, np.nan, *TABLE_4_6_MEANS[1:], np.nan),
)
"""Printed means by column of `TITLES`: at the measured poses, at uncalibrated ones [mm]."""


def katana_pictures(found: KatanaReproduction) -> tuple[Picture, ...]:
    """Every picture, in the order of the thesis."""
    once, weights = found.once, found.weights
    wanted: list[tuple[str, str, str, Callable[[], Figure]]] = [
        ("fig3-8", "Fig. 3.8: influence of the constants",
         "Motion of the tool for +0.05° or +0.1 mm of one constant at a time: least, mean and greatest over "
         "118 poses. Rings: the two means that the thesis reads from its figure.",
         lambda: influence_figure(found.influences, printed=PRINTED_INFLUENCE)),
        ("fig4-8", "Fig. 4.8: measured poses",
         "The 118 poses on the diagonal planes of the largest cube, from above and from the front; tails "
         "show the last link.", lambda: _poses(found.cube.q)),
        ("arms", "Tables 3.4, 4.5, 4.6 over many arms",
         f"{len(once.held_out)} virtual arms. Boxes: the middle half of the arms; whiskers: nine in ten. "
         "Crosses: the thesis. Left: mean error at the 118 measured poses; right: at 118 poses that took no "
         "part, where the crosses are the thesis's ten uncalibrated points, and dots the arms that were "
         "diagnosed.", lambda: _arms(once, found.diagnosed.held_out)),
        ("influence-arms", f"Influence based against least squares over {weights.before.shape[1]} arms",
         "Held-out error of the thesis's two ways as multiples of ordinary least squares, geometric mean "
         "over the arms with its 95 % interval. Below the dashed line they do better.",
         lambda: study_figure(weights)),
    ]  # fmt: skip
    return drawn(wanted)


def _arms(study: KatanaStudy, diagnosed: Float[np.ndarray, " some"]) -> Figure:
    """Errors of all arms by column, the thesis's beside."""
    parts = (
        ("118 measured poses", study.measured[:, :, 2, 3]),
        ("118 poses that took no part", study.held_out),
    )
    with look():
        figure = new_figure(10.0, 3.8)
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (title, table), stated in zip(panels, parts, PRINTED, strict=True):
            for column in range(len(TITLES)):
                _box(axes, column, table[:, column])
            axes.plot(range(len(TITLES)), stated, "x", ms=8, mew=1.8, color=COLOURS[1], label="thesis")
            names = (*TITLES, "diagnosed") if table is study.held_out else TITLES
            axes.set_xticks(range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor")
            axes.set_yscale("log")
            axes.set_yticks([0.02, 0.05, 0.1, 0.2, 0.5, 1.0], ["0.02", "0.05", "0.1", "0.2", "0.5", "1"])
            axes.minorticks_off()
            axes.set_title(title)
            grid(axes)
        panels[1].plot(np.full(len(diagnosed), len(TITLES)), diagnosed, "o", ms=4, color=COLOURS[2])
        panels[0].set_ylabel("mean position error [mm]")
        panels[0].legend(loc="lower left")
    return figure


def _box(axes: Axes, place: int, values: np.ndarray) -> None:
    minimum, low, middle, high, maximum = np.percentile(values, [5, 25, 50, 75, 95])
    colour = COLOURS[0] if place else NOMINAL
    axes.vlines(place, minimum, maximum, color=colour, lw=1.0)
    axes.vlines(place, low, high, color=colour, lw=14.0, alpha=0.7)
    axes.hlines(middle, place - 0.25, place + 0.25, color=INK, lw=1.2)


def _poses(q: np.ndarray) -> Figure:
    """Tool points with tails along the last link."""
    robot = load_robot("katana450")
    poses = tool_poses(robot, Motion(q))
    tips = 1e3 * poses[:, :3, 3]
    tails = tips - 35.0 * poses[:, :3, 2]
    with look():
        figure = new_figure(9.0, 4.4)
        for axes, (across, up) in zip(figure.subplots(1, 2), ((0, 1), (0, 2)), strict=True):
            for tip, tail in zip(tips, tails, strict=True):
                axes.plot(*np.array([tail, tip])[:, [across, up]].T, color=NOMINAL, lw=0.8)
            axes.plot(*tips[:, [across, up]].T, "o", ms=3, color=COLOURS[0])
            axes.plot(*(1e3 * robot.base.xyz[[across, up]]), "s", ms=8, color=INK)
            axes.set_xlabel(f"{'xyz'[across]} [mm]")
            axes.set_ylabel(f"{'xyz'[up]} [mm]")
            axes.set_aspect("equal")
            grid(axes, "both")
    return figure
