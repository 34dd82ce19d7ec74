"""The command about trajectories: compensate."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import DataError, FileError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Paths")
def compensate(
    trajectory: Annotated[
        Path,
        argument(
            "Table of time[s] and joints (q1[rad] …), or poses in the robot's base; or a robot program with "
            "joint targets."
        ),
    ],
    robot: Annotated[str, option("The calibrated robot (.toml or .urdf).")],
    out: Annotated[
        Path, option("Write the corrected joint positions here (.csv), or the corrected program.")
    ],
    nominal: Annotated[
        str | None, option("The controller's robot model; needed for joint positions.")
    ] = None,
    payload: Annotated[float | None, option("Mass at the tool [kg].")] = None,
    temperature: Annotated[float | None, option("Temperature [degC].")] = None,
    positions_only: Annotated[
        bool | None,
        option(
            "--positions-only/--orientations",
            "Ignore orientations (Katana eq. 5.22), or enforce them; default: correct what the "
            "calibration observed and keep the rest.",
        ),
    ] = None,
    columns: opt.ColumnsOption = None,
    sheet: opt.SheetOption = None,
) -> None:
    """Correct a joint trajectory with a calibrated robot, its effects included."""
    from workbench.data.readers.trajectory import read_trajectory
    from workbench.extras.trajectories.programs import read_program
    from workbench.extras.trajectories.trajectory_files import write_trajectory

    arm = wb.load_robot(robot)
    program = read_program(trajectory, arm.dof)
    rows = program and program.trajectory
    rows = rows or read_trajectory(trajectory, columns=columns, joints=arm.dof, sheet=sheet)
    opt.check_writable(out)
    try:
        found = wb.compensate(
            arm,
            rows,
            nominal=opt.load_nominal(nominal, arm),
            payload=payload,
            temperature=temperature,
            positions_only=positions_only,
        )
    except DataError as error:
        if program is None or error.row is None:
            raise
        raise FileError(str(error), path=str(trajectory), line=program.lines[error.row]) from error
    opt.give(found)
    if program is not None:
        change = f"{57.29577951308232 * abs(found.q - program.q).max():.4f}°"
        opt.say(f"maximum change: {change}, in {plural(len(program.q), 'joint target')}")
        if found.kept.any():
            lines = (str(n) for n, kept in zip(program.lines, found.kept, strict=True) if kept)
            opt.say(f"unchanged: the targets of lines {', '.join(lines)}")
        opt.say(f"corrected program: {program.save(found.q, out)}")
    else:
        opt.say(f"corrected joints: {write_trajectory(found, out, rows.units)}")
