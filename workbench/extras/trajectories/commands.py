"""The commands about trajectories: path circle and line, compensate."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.exit_status import group, in_section
from workbench.cli.options import argument, option

path = group(
    "path",
    "Trajectories along a circle or a line, rest to rest, with constant tool direction.",
    section="Paths",
)


@dataclass(frozen=True)
class PlanOptions:
    """Options for the arm that runs a path, the motion, and the output."""

    robot: opt.RobotOption
    out: Annotated[Path, option("Write time, joints and poses here (.csv).")]
    duration: Annotated[float, option("Time from beginning to end [s].")] = 20.0
    rows: Annotated[int, option("Number of samples.")] = 200
    axis: Annotated[
        str | None,
        option("Direction x,y,z of the tool's z axis; default: normal to the path's plane, from above."),
    ] = None
    json: opt.JsonOption = None

    def make(self, curve) -> None:
        """Plan, show and write."""
        from workbench.extras.trajectories.planning import plan
        from workbench.extras.trajectories.trajectory_files import write_plan

        opt.check_writable(self.out, self.json)
        pointing = None if self.axis is None else _point(self.axis, "--axis")
        arm = wb.load_robot(self.robot)
        planned = plan(arm, curve, duration=self.duration, rows=self.rows, axis=pointing)
        opt.give(planned, self.json)
        opt.say(f"trajectory: {write_plan(planned, self.out)}")


@path.command()
@opt.flattened
def circle(
    options: PlanOptions,
    through: Annotated[
        list[str], option("A point x,y,z [m] in the robot's base frame; three or more, in order.")
    ],
) -> None:
    """A circle through given points."""
    import numpy as np

    from workbench.extras.trajectories.curves import circle_through

    options.make(circle_through(np.array([_point(text, "--through") for text in through])))


@path.command()
@opt.flattened
def line(
    options: PlanOptions,
    start: Annotated[str, option("--from", "Start: x,y,z [m], robot's base frame.")],
    end: Annotated[str, option("--to", "End: x,y,z [m].")],
) -> None:
    """A straight line between two points."""
    from workbench.extras.trajectories.curves import line as straight

    options.make(straight(_point(start, "--from"), _point(end, "--to")))


def _point(text: str, option: str):
    """Three comma-separated numbers."""
    point = opt.numbers(text)
    if point.shape != (3,):
        raise OptionError(f"{option} must be x,y,z in m, got '{text}'")
    return point


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
    method: Annotated[str, option("iterated, or one-step: Δq = −Jᵀ(JJᵀ + λ)⁻¹ Δx.")] = "iterated",
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
    json: opt.JsonOption = None,
    columns: opt.ColumnsOption = None,
    sheet: opt.SheetOption = None,
) -> None:
    """Correct a joint trajectory with a calibrated robot, its effects included."""
    from workbench.data.readers.trajectory import read_trajectory
    from workbench.extras.trajectories.programs import read_program
    from workbench.extras.trajectories.trajectory_files import write_trajectory

    arm = wb.load_robot(robot)
    program = read_program(trajectory, arm.dof)
    if program is not None:
        rows = program.trajectory
    else:
        rows = read_trajectory(trajectory, columns=columns, joints=arm.dof, sheet=sheet)
    opt.check_writable(out, json)
    try:
        found = wb.compensate(
            arm,
            rows,
            nominal=opt.load_nominal(nominal, arm),
            method=method,
            payload=payload,
            temperature=temperature,
            positions_only=positions_only,
        )
    except DataError as error:
        if program is None or error.row is None:
            raise
        raise FileError(str(error), path=str(trajectory), line=program.lines[error.row]) from error
    opt.give(found, json)
    if program is not None:
        change = f"{57.29577951308232 * abs(found.q - program.q).max():.4f}°"
        opt.say(f"maximum change: {change}, in {plural(len(program.q), 'joint target')}")
        if found.kept.any():
            lines = (str(n) for n, kept in zip(program.lines, found.kept, strict=True) if kept)
            opt.say(f"unchanged: the targets of lines {', '.join(lines)}")
        opt.say(f"corrected program: {program.save(found.q, out)}")
    else:
        opt.say(f"corrected joints: {write_trajectory(found, out, rows.units)}")
