"""The figures and numbers of the Katana thesis done again."""

import numpy as np
from matplotlib.figure import Figure

from studies import katana_printed as printed
from studies.influence_study import METHODS, TROUBLES
from studies.katana import KatanaReproduction
from studies.katana_pencil import METHODS as DRAWN
from studies.katana_study import REMAINDER, TITLES, KatanaStudy, spread
from studies.katana_tracking import PATHS, STEPS, path_moments
from studies.output import Json, Output, curves
from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.extras.trajectories.planning import Planned
from workbench.identification.report.constants import influence_figure
from workbench.report.colours import NOMINAL
from workbench.report.figures import COLOURS, INK, grid, look, new_figure

SOURCE = (
    "Thesis on the calibration of the Katana 450 serial robot: influence-based identification (chapter 3), "
    "joint tilting (chapter 4), trajectory tracking (chapter 5)"
)


def katana_output(found: KatanaReproduction) -> Output:
    """What `workbench reproduce katana` writes."""
    return Output(
        work="katana",
        source=SOURCE,
        findings=found.findings,
        sheets=found.sheets,
        figures=katana_figures(found),
        numbers={
            "arms": found.arms,
            "seed": found.seed,
            "remainder_deg": np.rad2deg(REMAINDER),
            "studies": [_study_json(study) for study in (found.once, found.twice, found.as_bad)],
            "diagnosed": {"held_out_mm": found.diagnosed.held_out, "plays_named": found.diagnosed.named},
            "inclinometer_relative_errors": found.experiments.errors,
            "influence_mean_mm": dict(
                zip(found.influences.names, (1e3 * found.influences.mean).tolist(), strict=True)
            ),
            "influence_study": [
                {
                    "trouble": trouble.name,
                    "poses": number,
                    "method": method,
                    "ratio": found.weights.ratio(t, n, m)._asdict(),
                }
                for t, trouble in enumerate(TROUBLES)
                for n, number in enumerate(found.weights.numbers)
                for m, method in list(enumerate(METHODS))[1:]
            ],
            "tracking_mm": {
                path: {step: found.tracking.spread(s, p)._asdict() for s, step in enumerate(STEPS)}
                for p, path in enumerate(PATHS)
            },
        },
    )


def katana_figures(found: KatanaReproduction) -> dict[str, Figure]:
    """Figs. 3.8 and 4.8, and the circle of chapter 5: Figs. 5.7 to 5.10, 5.12 and 5.13 on virtual arms."""
    circle, pencil = found.tracking.paths[0], found.pencil
    moments, degrees = path_moments(circle), np.rad2deg(1.0)
    motion = {"joints [°]": degrees * circle.q, "speeds [°/s]": degrees * np.asarray(circle.motion.velocity)}
    loads = {f"across the axis, about {side} [N m]": moments.across[:, :, i] for i, side in enumerate("xy")}
    alone, read = ("stiffness alone", "tilting"), [f"{title}, read" for title in DRAWN]
    return {
        "fig3-8": influence_figure(found.influences, printed=printed.PRINTED_INFLUENCE),
        "fig4-8": _poses(found.cube.q),
        "fig5-7": _joints_over_time(circle, motion),
        "fig5-8": _joints_over_time(circle, {"about the axis [N m]": moments.about, **loads}),
        "fig5-10": curves(circle.time, found.tracking.alone, alone, "error [mm]"),
        "fig5-12": curves(circle.time, found.tracking.example, STEPS, "error [mm]"),
        "fig5-13": curves(
            pencil.time, np.vstack([pencil.actual, pencil.read]), (*DRAWN, *read), "distance from circle [mm]"
        ),
    }


def _joints_over_time(planned: Planned, panels: dict[str, np.ndarray]) -> Figure:
    """Numbers of every joint along a path, a panel each."""
    with look():
        figure = new_figure(3.4 * len(panels) + 0.8, 3.2)
        for axes, (title, values) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
            for joint, (column, colour) in enumerate(zip(values.T, COLOURS, strict=False), start=1):
                axes.plot(planned.time, column, color=colour, label=f"joint {joint}")
            axes.set(xlabel="time [s]", title=title)
            grid(axes)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=planned.robot.dof)
    return figure


def _poses(q: np.ndarray) -> Figure:
    """Tool points with tails along the last link, from above and from the front."""
    robot = load_robot("katana450")
    poses = tool_poses(robot, Motion(q))
    tips = 1e3 * poses[:, :3, 3]
    lines = np.stack([tips - 35.0 * poses[:, :3, 2], tips])
    with look():
        figure = new_figure(9.0, 4.4)
        for axes, (across, up) in zip(figure.subplots(1, 2), ((0, 1), (0, 2)), strict=True):
            axes.plot(lines[:, :, across], lines[:, :, up], color=NOMINAL, lw=0.8)
            axes.plot(*tips[:, [across, up]].T, "o", ms=3, color=COLOURS[0])
            axes.plot(*(1e3 * robot.base.xyz[[across, up]]), "s", ms=8, color=INK)
            axes.set(xlabel=f"{'xyz'[across]} [mm]", ylabel=f"{'xyz'[up]} [mm]", aspect="equal")
    return figure


def _study_json(study: KatanaStudy) -> Json:
    tables = {
        "measured_mm": study.measured[:, :, 2, 3],
        "held_out_mm": study.held_out,
        "ten_points_mm": study.ten.mean(axis=2),
        "held_out_deg": study.turned,
    }
    return {
        "share_of_printed_play": study.play,
        "multiple_of_table_3_2": study.share,
        "columns": list(TITLES),
        **{name: [spread(column)._asdict() for column in table.T] for name, table in tables.items()},
    }
