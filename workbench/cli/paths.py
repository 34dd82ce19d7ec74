"""The commands about trajectories: path circle, path line; compensate, which corrects one."""

from pathlib import Path
from typing import Annotated

import typer

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.ending import Commands

paths = typer.Typer(
    name="path",
    help="Trajectories along a circle or a line, from rest to rest, with the tool's direction held.",
    no_args_is_help=True,
    cls=Commands,
)

OutOption = Annotated[Path, typer.Option(help="Write time, joints and poses here (.csv).")]
DurationOption = Annotated[float, typer.Option(help="Time from beginning to end [s].")]
RowsOption = Annotated[int, typer.Option(help="Number of samples.")]
AxisOption = Annotated[
    str | None,
    typer.Option(help="Direction x,y,z of the tool's z axis; into the path's plane from above if not given."),
]
SpeedOption = Annotated[
    float | None, typer.Option(help="Greatest speed of any joint [rad/s or m/s]; else not checked.")
]
PictureOption = Annotated[
    Path | None, typer.Option(help="Draw joints, speeds, torques and moments across the axes here (.png).")
]


@paths.command()
def circle(
    robot: opt.RobotOption,
    out: OutOption,
    through: Annotated[
        list[str] | None,
        typer.Option(help="A point x,y,z [m] in the robot's base frame; three or more, in order."),
    ] = None,
    taught: Annotated[
        Path | None, typer.Option(help="Joints at three points or more, led there by hand, instead.")
    ] = None,
    duration: DurationOption = 20.0,
    rows: RowsOption = 200,
    axis: AxisOption = None,
    max_speed: SpeedOption = None,
    picture: PictureOption = None,
    json: opt.JsonOption = None,
) -> None:
    """A circle through points, or through points that were taught."""
    import numpy as np

    from workbench.paths.curves import circle_through
    from workbench.paths.trajectories import read_taught, taught_circle

    if (taught is None) == (not through):
        raise OptionError("a circle needs --through, three times or more, or --taught with a file of joints")
    arm = wb.load_robot(robot)
    if taught is not None:
        curve = taught_circle(arm, read_taught(taught, arm))
    else:
        curve = circle_through(np.array([_point(text, "--through") for text in through or ()]))
    _make(arm, curve, out, duration, rows, axis, max_speed, picture, json)


@paths.command()
def line(
    robot: opt.RobotOption,
    out: OutOption,
    start: Annotated[str, typer.Option("--from", help="Where it begins: x,y,z [m], robot's base frame.")],
    end: Annotated[str, typer.Option("--to", help="Where it ends: x,y,z [m].")],
    duration: DurationOption = 10.0,
    rows: RowsOption = 200,
    axis: AxisOption = None,
    max_speed: SpeedOption = None,
    picture: PictureOption = None,
    json: opt.JsonOption = None,
) -> None:
    """A straight line between two points."""

    from workbench.paths.curves import line as straight

    curve = straight(_point(start, "--from"), _point(end, "--to"))
    _make(wb.load_robot(robot), curve, out, duration, rows, axis, max_speed, picture, json)


def _make(arm, curve, out, duration, rows, axis, max_speed, picture, json) -> None:
    """Plan, show and write."""
    from workbench.base.files import write_bytes
    from workbench.paths.planning import plan
    from workbench.paths.report import path_json, path_picture, path_table
    from workbench.paths.trajectories import planned_moments, write_plan

    if picture is not None and picture.suffix.lower() != ".png":
        raise OptionError(f"{picture}: a picture is written as .png; choose this ending")
    opt.check_writable(out, picture, json)
    pointing = None if axis is None else _point(axis, "--axis")
    planned = plan(arm, curve, duration=duration, rows=rows, axis=pointing, max_speed=max_speed)
    moments = planned_moments(planned)
    opt.show(path_table(planned, moments))
    opt.say(f"trajectory: {write_plan(planned, out)}")
    if picture is not None:
        opt.say(f"picture: {write_bytes(picture, path_picture(planned, moments))}")
    opt.write_result(json, path_json(planned, moments))


def _point(text: str, option: str):
    """Three numbers with commas between."""
    point = opt.numbers(text)
    if point.shape != (3,):
        raise OptionError(f"{option} must be x,y,z in m, got '{text}'")
    return point


def compensate(
    trajectory: Annotated[
        Path, typer.Argument(help="Table of time[s] and joints (q1[rad] …), or poses in the robot's base.")
    ],
    robot: Annotated[str, typer.Option(help="The calibrated robot (.toml or .urdf).")],
    out: Annotated[Path, typer.Option(help="Write the corrected joints here (.csv).")],
    nominal: Annotated[
        str | None, typer.Option(help="The robot as its controller computes it; needed for joints.")
    ] = None,
    method: Annotated[str, typer.Option(help="iterated, or one-step: Δq = −Jᵀ(JJᵀ + λ)⁻¹ Δx.")] = "iterated",
    payload: Annotated[float | None, typer.Option(help="Mass at the tool [kg].")] = None,
    temperature: Annotated[float | None, typer.Option(help="Temperature [degC].")] = None,
    max_speed: Annotated[
        float | None, typer.Option(help="Greatest speed of any joint [rad/s or m/s]; else not checked.")
    ] = None,
    positions_only: Annotated[
        bool, typer.Option("--positions-only", help="Orientations do not matter; Katana eq. (5.22).")
    ] = False,
    moving: Annotated[
        bool, typer.Option("--moving", help="Loads with the links' inertia; else those at rest.")
    ] = False,
    json: opt.JsonOption = None,
    columns: opt.ColumnsOption = None,
    sheet: opt.SheetOption = None,
) -> None:
    """Correct a joint trajectory with a calibrated robot, its effects included."""

    from workbench.data.readers.trajectory import read_trajectory
    from workbench.paths.report import compensation_json, compensation_table
    from workbench.paths.trajectories import write_trajectory

    arm = wb.load_robot(robot)
    rows = read_trajectory(trajectory, columns=columns, joints=arm.dof, sheet=sheet)
    opt.check_writable(out, json)
    found = wb.compensate(
        arm,
        rows,
        nominal=None if nominal is None else wb.load_robot(nominal),
        method=method,
        payload=payload,
        temperature=temperature,
        max_speed=max_speed,
        positions_only=positions_only,
        moving=moving,
    )
    opt.show(compensation_table(found))
    opt.say(f"corrected joints: {write_trajectory(found, out)}")
    opt.write_result(json, compensation_json(found))
