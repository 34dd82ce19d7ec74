"""Commands: pencil sheet, draw and errors."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import argument, option

pencil = group(
    "pencil",
    "Check tracking with pencil, paper and a potentiometer: retrace a printed circle.",
    section="Paths",
)

RadiusOption = Annotated[str, option("Radius of the printed circle, such as 100mm.")]
DotsOption = Annotated[float, option("Dots per inch.")]
TrajectoryArgument = Annotated[Path, argument("The circle as `workbench path circle` wrote it.")]


@pencil.command()
def sheet(
    out: Annotated[Path, option("Write the sheet here (.png); print it in colour.")],
    radius: RadiusOption = "100mm",
    dpi: DotsOption = 300.0,
) -> None:
    """The sheet to print: a red circle with quarter marks and a long mark where the path begins."""
    from workbench.extras.trajectories.pencil.check import write_sheet

    opt.check_writable(out)
    opt.say(f"sheet: {write_sheet(_radius(radius), opt.png(out), dpi=_dots(dpi))}")


@pencil.command()
def draw(
    trajectory: TrajectoryArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, option("Write the scan here (.png).")],
    readings: Annotated[Path, option("Write the potentiometer's readings here (.csv).")],
    dpi: DotsOption = 300.0,
    seed: opt.SeedOption = 0,
) -> None:
    """Let a virtual arm draw the circle: scan and potentiometer readings."""
    from workbench.data.readers import read_trajectory
    from workbench.extras.trajectories.pencil.check import draw_path

    arm = wb.load_robot(robot)
    rows = read_trajectory(trajectory, joints=arm.dof)
    opt.check_writable(opt.png(out), readings)
    draw_path(arm, rows, out, readings, seed=seed, dpi=_dots(dpi))
    opt.say(f"scan: {out}")
    opt.say(f"readings: {readings}")


@pencil.command()
def errors(
    scan: Annotated[Path, argument("Scan of the sheet with the drawing, in colour.")],
    radius: RadiusOption = "100mm",
    path: Annotated[Path | None, option("The commanded circle: time and poses.")] = None,
    readings: Annotated[
        Path | None, option("Potentiometer: time[s], distance[mm] beyond its length at rest.")
    ] = None,
    picture: Annotated[Path | None, option("Draw the errors here (.png).")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Errors along a drawn circle: outside and inside from the scan, above and below from the readings."""
    from workbench.base.files import write_bytes
    from workbench.data.readers import read_trajectory
    from workbench.extras.trajectories.pencil.check import (
        plotted_json,
        plotted_picture,
        plotted_table,
        read_drawing,
    )

    opt.check_writable(None if picture is None else opt.png(picture), json)
    rows = None if path is None else read_trajectory(path)
    found = read_drawing(scan, _radius(radius), trajectory=rows, readings=readings)
    opt.show(plotted_table(found))
    if picture is not None:
        opt.say(f"picture: {write_bytes(picture, plotted_picture(found))}")
    opt.write_result(json, plotted_json(found))


def _radius(text: str) -> float:
    """A length greater than zero [m]."""
    radius = opt.length(text)
    if not 0.0 < radius < 1.0:
        raise OptionError(f"--radius must be between 0 and 1 m, got '{text}'")
    return radius


def _dots(dpi: float) -> float:
    if not 50.0 <= dpi <= 1200.0:
        raise OptionError(f"--dpi must be 50–1200, got {dpi:g}")
    return dpi
