"""The command that corrects trajectories: compensate."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.options import (
    ColumnsOption,
    JsonOption,
    SheetOption,
    check_writable,
    say,
    show,
)


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
    json: JsonOption = None,
    columns: ColumnsOption = None,
    sheet: SheetOption = None,
) -> None:
    """Correct a joint trajectory with a calibrated robot, its effects included."""
    from workbench.arm.library import load_robot
    from workbench.data.readers.trajectory import read_trajectory
    from workbench.paths.report import compensation_json, compensation_table
    from workbench.paths.trajectories import compensate_trajectory, write_trajectory
    from workbench.report.json import write_json

    arm = load_robot(robot)
    rows = read_trajectory(trajectory, columns=columns, joints=arm.dof, sheet=sheet)
    check_writable(out, json)
    found = compensate_trajectory(
        arm,
        rows,
        nominal=None if nominal is None else load_robot(nominal),
        method=method,
        payload=payload,
        temperature=temperature,
        max_speed=max_speed,
        positions_only=positions_only,
        moving=moving,
    )
    show(compensation_table(found))
    say(f"corrected joints: {write_trajectory(found, out)}")
    if json is not None:
        say(f"result: {write_json(json, compensation_json(found))}")
