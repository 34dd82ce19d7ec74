"""Printed numbers of the Katana thesis's chapter 5 beside ours, and pictures of its figures."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies import katana_printed as printed
from studies import katana_tracking as tracking
from studies.finding import Finding, checked, judged, without
from studies.katana_study import Spread, spread
from studies.katana_tracking import STEPS, TrackingStudy
from studies.page import Picture, drawn
from workbench.arm.motion import Motion
from workbench.arm.statics.moments import JointMoments, joint_moments
from workbench.extras.trajectories.path_pictures import draw_moments, draw_motion
from workbench.extras.trajectories.planning import Planned
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

BETTER = (tracking.GEOMETRY, tracking.STIFFNESS, tracking.TILTING)
"""Columns with a printed number."""
COLUMN_COLOURS = (NOMINAL, *COLOURS)


def tracking_findings(study: TrackingStudy) -> tuple[Finding, ...]:
    """Every number of chapter 5 beside ours."""
    circle, line = printed.TRACKED, printed.TRACKED_LINE
    reasons = (
        "the errors of these arms are drawn from Table 3.2, the thesis's arm is one of them",
        "samples of the path itself take up most of what the arm does there",
    )
    found = [
        judged(
            "§5.5.1",
            f"circle, mean error {STEPS[step]} [mm]" + (", so many times less" if step else ""),
            f"{circle[step]:.3f}" + (f", {circle[0] / circle[step]:.1f}×" if step else ""),
            study.spread(step).text(3) + (f", {study.reduction(step).text(1)}×" if step else ""),
            _matches(study, step),
            reasons[min(step, 1)],
        )
        for step in (tracking.BEFORE, *BETTER)
    ]
    near = study.spread(tracking.TILTING, tracking.LINE_NEAR)
    found.append(
        judged(
            "§5.5.1",
            "line, mean error tilting first [mm]",
            f"{line:.3f}",
            near.text(3),
            near.low <= line <= near.high,
            "identified on samples of the circle alone; the line is another path and chosen here",
        )
    )
    return (*found, _stiffness(study), _methods(study), _elsewhere(study), *_loads(study))


def _stiffness(study: TrackingStudy) -> Finding:
    """What correcting the stiffness brings before the tilting."""
    gain = _gain(study)
    stated = printed.TRACKED[tracking.GEOMETRY] - printed.TRACKED[tracking.STIFFNESS]
    return judged(
        "§5.5.1", "stiffness first lowers the mean error on the circle by [mm]", f"{stated:.3f}",
        gain.text(3), gain.low <= stated <= gain.high,
        "stiffness first brings nothing here: the path's own samples have taken it up",
    )  # fmt: skip


def _gain(study: TrackingStudy) -> Spread:
    """By how much the error on the circle falls when stiffness is corrected first [mm]."""
    geometry, stiffness = (study.mean[:, step, tracking.CIRCLE] for step in BETTER[:2])
    return spread(geometry - stiffness)


def _methods(study: TrackingStudy) -> Finding:
    """The thesis's own way against ours, on the circle itself."""
    own, ours = study.spread(tracking.TILTING), study.spread(tracking.OURS)
    return checked(
        "§5.5.1", "from 118 poses / the thesis's way, from samples of the circle; on the circle [mm]",
        "–", f"{ours.text(3)} / {own.text(3)}", ours.median <= own.median,
        _better(study),
    )  # fmt: skip


def _better(study: TrackingStudy) -> str:
    """On which paths the thesis's own way is better, and on which ours."""
    gap = np.median(study.mean[:, tracking.OURS] - study.mean[:, tracking.TILTING], axis=0)
    own, ours = (
        ", ".join(path for path, wide in zip(tracking.PATHS, gap, strict=True) if bool(wide > 0.0) is better)
        for better in (True, False)
    )
    message = (f"the thesis's own way, from samples of the circle, is better on: {own}", f"ours on: {ours}")
    return "; ".join(text for text, paths in zip(message, (own, ours), strict=True) if paths)


def _matches(study: TrackingStudy, step: int) -> bool:
    """Whether the intervals of the arms enclose the printed error, and how many times less it is."""
    stated, ours, less = printed.TRACKED, study.spread(step), study.reduction(step)
    factor = stated[0] / stated[step]
    return ours.low <= stated[step] <= ours.high and less.low - 0.05 <= factor <= less.high + 0.05


def _elsewhere(study: TrackingStudy) -> Finding:
    """§5.5.1: geometric parameters need not be corrected for a different trajectory."""
    there = study.spread(tracking.TILTING, tracking.LINE_FAR)
    ours = study.spread(tracking.OURS, tracking.LINE_FAR)
    return judged(
        "§5.5.1",
        "parameters from samples of one trajectory hold for another [mm]",
        "no correction needed",
        f"before {study.spread(tracking.BEFORE, tracking.LINE_FAR).text()}, then {there.text()}; "
        f"from 118 poses {ours.text()}",
        there.median < study.spread(tracking.BEFORE, tracking.LINE_FAR).median / 2.0,
        "one path leaves directions of the constants open, and another posture shows them; poses from the "
        "whole workspace close them",
    )


def _loads(study: TrackingStudy) -> tuple[Finding, ...]:
    """What the thesis reads from its figs. 5.8 to 5.10."""
    moments = _moments(study.paths[0])
    own, across = np.abs(moments.about[:, 0]).max(), moments.tipping[:, 0].max()
    stiff, tilted = study.alone.mean(axis=1)
    return (
        judged(
            "Fig. 5.9",
            "joint 1: moments across the axis exceed the torque about it [N m]",
            "exceed",
            f"{across:.2f} against {own:.3f}",
            across > own,
        ),
        judged(
            "Fig. 5.10",
            "tilting costs more than stiffness alone, mean along the circle [mm]",
            "significantly more",
            f"{tilted:.2f} against {stiff:.2f}",
            tilted > 2.0 * stiff,
        ),
        without(
            "Figs. 5.7–5.10, 5.12",
            "courses of the curves",
            "curves",
            "read from pictures without numbers; posture, duration and the mass of link 1 are not printed",
        ),
    )


def tracking_pictures(study: TrackingStudy) -> tuple[Picture, ...]:
    """Counterparts of figs. 5.7 to 5.10 and 5.12, and the errors of all arms."""
    circle, arms = study.paths[0], len(study.mean)
    wanted: tuple[tuple[str, str, str, Callable[[], Figure]], ...] = (
        ("fig5-7", "Fig. 5.7: joints along the circle", f"From rest to rest in {circle.time[-1]:g} s.",
         lambda: _drawn(8.0, lambda figure: draw_motion(figure, circle))),
        ("fig5-8", "Figs. 5.8, 5.9: torques, and moments across the axes",
         "What holds the links in motion, in the axes of the frame right before each joint.",
         lambda: _drawn(10.0, lambda figure: draw_moments(figure, circle, _moments(circle)))),
        ("fig5-10", "Fig. 5.10: what the joints alone would do",
         "Distance of the nominal arm with the joints of Table 5.2 from the circle.",
         lambda: _alone(study)),
        ("fig5-12", "Fig. 5.12: one arm along the circle",
         "The first virtual arm as it comes, and corrected in every way.", lambda: _example(study)),
        ("tracking-arms", f"Tracking over {arms} arms",
         "Mean error along each path. Dots: arms; bars: medians; crosses: the thesis. Stiffness first brings "
         f"the circle {_gain(study).text(3)} mm here, next to nothing. {_better(study).capitalize()}.",
         lambda: _arms(study)),
    )  # fmt: skip
    return drawn(wanted)


def _moments(path: Planned) -> JointMoments:
    return joint_moments(path.robot, Motion(path.q, **path.motion.drivers))


def _drawn(width: float, draw: Callable[[Figure], None]) -> Figure:
    with look():
        figure = new_figure(width, 3.2)
        draw(figure)
    return figure


def _alone(study: TrackingStudy) -> Figure:
    with look():
        figure = new_figure(6.0, 3.0)
        axes = figure.subplots()
        for row, text, colour in zip(study.alone, ("stiffness alone", "tilting"), COLOURS, strict=False):
            axes.plot(study.paths[0].time, row, color=colour, label=text)
        _finish(axes)
    return figure


def _example(study: TrackingStudy) -> Figure:
    with look():
        figure = new_figure(7.5, 3.4)
        axes = figure.subplots()
        for row, text, colour in zip(study.example, STEPS, COLUMN_COLOURS, strict=False):
            axes.plot(study.paths[0].time, row, color=colour, label=text)
        _finish(axes)
    return figure


def _finish(axes: Axes) -> None:
    axes.set_xlabel("time [s]")
    axes.set_ylabel("error [mm]")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    grid(axes)


def _arms(study: TrackingStudy) -> Figure:
    """One dot an arm, one column a step, one panel a path."""
    thesis = ((*printed.TRACKED, np.nan), (*[np.nan] * 3, printed.TRACKED_LINE, np.nan), (np.nan,) * 5)
    with look():
        figure = new_figure(10.0, 3.6)
        panels = figure.subplots(1, len(tracking.PATHS), sharey=True)
        for path, (axes, title) in enumerate(zip(panels, tracking.PATHS, strict=True)):
            for step in range(len(STEPS)):
                values = study.mean[:, step, path]
                places = step + np.linspace(-0.25, 0.25, len(values))
                axes.plot(places, np.sort(values), ".", ms=3.0, color=COLUMN_COLOURS[step])
                axes.hlines(np.median(values), step - 0.35, step + 0.35, color=INK, lw=1.4)
            axes.plot(range(len(STEPS)), thesis[path], "x", color=INK, ms=7.0, mew=1.6)
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
            axes.set_xticks(range(len(STEPS)), [text.replace(" ", "\n") for text in STEPS])
            axes.set_title(title)
            grid(axes)
        panels[0].set_ylabel("mean error [mm]")
    return figure
