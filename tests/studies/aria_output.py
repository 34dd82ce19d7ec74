"""The figures and numbers of the ARIA paper done again: clusters (Fig. 5), tool (6a), errors (7, 11)."""

from collections import defaultdict
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies import aria_printed as printed
from studies.aria import AriaReproduction
from studies.aria_arms import TITLES, Comparison
from studies.error_grid import error_grid
from studies.output import Json, Output
from workbench.data.prediction import RowComponents
from workbench.extras.poses.cluster_report import cluster_json
from workbench.identification.result import ArmErrors
from workbench.report.figures import COLOURS, INK, look, new_figure

SOURCE = (
    "K. Arent, A. Kurnicki, P. Portasiak, B. Stańczyk: Kinematic calibration of a lightweight manipulator. "
    "Bull. Pol. Acad. Sci. Tech. Sci. 72(6), e151381, 2024"
)
NOTHING = RowComponents(np.zeros((0, 3)), np.zeros((0, 3)))


def aria_output(found: AriaReproduction) -> Output:
    """What `workbench reproduce aria` writes."""
    return Output(
        work="aria",
        source=SOURCE,
        findings=found.findings,
        sheets=found.sheets,
        figures=aria_figures(found),
        numbers={
            "arms": found.arms,
            "seed": found.seed,
            "clustering": cluster_json(found.clustering),
            "comparison": [_comparison_json(c) for c in (*found.exact, *found.noisy)],
        },
    )


def aria_figures(found: AriaReproduction) -> dict[str, Figure]:
    """Figs. 5, 6a, 7 (one virtual arm with noise) and 11 (a virtual arm with Table 4's constants)."""
    figures = {"fig5": _clusters(found), "fig6a": _tool(found)}
    for letter, (k, rotation) in zip("abcdef", product(range(3), (False, True)), strict=True):
        figures[f"fig7{letter}"] = _errors(found.noisy[k].example, rotation=rotation)
    for letter, rotation in (("a", False), ("b", True)):
        figures[f"fig11{letter}"] = _errors(found.on_table_4, rotation=rotation)
    return figures


def _errors(errors: tuple[RowComponents, ...], *, rotation: bool) -> Figure:
    """Errors of the nominal arm and of the three algorithms at the ten measured poses, axis by axis."""
    columns = tuple(ArmErrors(title, rows, NOTHING) for title, rows in zip(TITLES, errors, strict=True))
    limit = printed.REQUIRED_ANGLE if rotation else 1e3 * printed.REQUIRED_POSITION
    figure = error_grid(columns, np.arange(1, len(columns[0].train) + 1), rotation=rotation, limit=limit)
    assert figure is not None
    return figure


def _tool(found: AriaReproduction) -> Figure:
    """Targets from above; lines show where the tool comes from."""
    places = 1e3 * found.plate.poses[:, :3, 3]
    tails = places - 120.0 * found.plate.poses[:, :3, 2]
    with look():
        figure = new_figure(5.2, 5.2)
        axes = figure.subplots()
        _region(axes, found, 0, 1)
        for number, (place, tail) in enumerate(zip(places, tails, strict=True), start=1):
            axes.plot(*np.array([tail, place])[:, :2].T, color=INK, lw=0.9)
            axes.plot(*place[:2], "s", ms=9, color=COLOURS[number % 2])
            axes.text(place[0] + 14, place[1] + 10, str(number))
        axes.plot(0, 0, "o", ms=12, color=INK)
    return figure


def _clusters(found: AriaReproduction) -> Figure:
    """The cubes of the ten poses of equal O, from above and from the front."""
    region = found.clustering.region
    with look():
        figure = new_figure(9.0, 4.4)
        for axes, (across, up) in zip(figure.subplots(1, 2), ((0, 1), (0, 2)), strict=True):
            _region(axes, found, across, up)
            numbers = defaultdict(list)
            for number, cube in enumerate(found.clustering.best.cubes, start=1):
                numbers[tuple((1e3 * region.centres[cube])[[across, up]].round(6))].append(str(number))
            for (x, y), here in numbers.items():
                axes.plot(x, y, "s", ms=22, color=COLOURS[0], alpha=0.35)
                axes.text(x, y, ", ".join(here), ha="center", va="center")
    return figure


def _region(axes: Axes, found: AriaReproduction, across: int, up: int) -> None:
    """The region with the lines between its cubes, seen along one axis [mm]."""
    region = found.clustering.region
    low, high = 1e3 * region.min, 1e3 * region.max
    for axis, other, draw in ((across, up, axes.vlines), (up, across, axes.hlines)):
        lines = np.linspace(low[axis], high[axis], region.shape[axis] + 1)
        draw(lines, low[other], high[other], color=INK, lw=0.5, alpha=0.4)
    axes.set(xlabel=f"{'XYZ'[across]} [mm]", ylabel=f"{'XYZ'[up]} [mm]", aspect="equal")


def _comparison_json(comparison: Comparison) -> Json:
    tables = {
        "measured_position_mm": 1e3 * comparison.own_position,
        "measured_orientation_deg": np.rad2deg(comparison.own_rotation),
        "region_position_mm": 1e3 * comparison.region,
        "region_orientation_deg": np.rad2deg(comparison.region_rotation),
        "anywhere_position_mm": 1e3 * comparison.anywhere,
    }
    return {
        "way": comparison.acquisition.name,
        "instrument": comparison.instrument.name,
        "reached": comparison.reached,
        "q": comparison.acquisition.q,
        "errors": {
            name: {
                title: {"median": np.nanmedian(t[:, k]), "max": np.nanmax(t[:, k])}
                for k, title in enumerate(TITLES)
            }
            for name, t in tables.items()
        },
    }
