"""The commands of the low-cost check: pencil sheet, pencil draw, pencil errors."""

from pathlib import Path
from typing import Annotated

import typer

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.ending import Commands

pencil = typer.Typer(
    name="pencil",
    help="Tracking checked with pencil, paper and a potentiometer: a circle drawn on a printed one.",
    no_args_is_help=True,
    cls=Commands,
)

RadiusOption = Annotated[str, typer.Option(help="Radius of the printed circle, such as 100mm.")]
DotsOption = Annotated[float, typer.Option(help="Dots per inch.")]
TrajectoryArgument = Annotated[Path, typer.Argument(help="The circle as `workbench path circle` wrote it.")]


@pencil.command()
def sheet(
    out: Annotated[Path, typer.Option(help="Write the sheet here (.png); print it in colour.")],
    radius: RadiusOption = "100mm",
    dpi: DotsOption = 300.0,
) -> None:
    """The sheet to print: a red circle, marks at its quarters, a long one where the path begins."""
    from workbench.paths.pencil.check import write_sheet

    opt.check_writable(out)
    opt.say(f"sheet: {write_sheet(_radius(radius), _png(out), dpi=_dots(dpi))}")


@pencil.command()
def draw(
    trajectory: TrajectoryArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, typer.Option(help="Write the scan here (.png).")],
    readings: Annotated[Path, typer.Option(help="Write the potentiometer's readings here (.csv).")],
    dpi: DotsOption = 300.0,
    seed: opt.SeedOption = 0,
) -> None:
    """A virtual arm draws the circle: its scan and the readings."""

    from workbench.data.readers import read_trajectory
    from workbench.paths.pencil.check import draw_path

    arm = wb.load_robot(robot)
    rows = read_trajectory(trajectory, joints=arm.dof)
    opt.check_writable(_png(out), readings)
    draw_path(arm, rows, out, readings, seed=seed, dpi=_dots(dpi))
    opt.say(f"scan: {out}")
    opt.say(f"readings: {readings}")


@pencil.command()
def errors(
    scan: Annotated[Path, typer.Argument(help="Scan of the sheet with the drawing, in colour.")],
    radius: RadiusOption = "100mm",
    path: Annotated[Path | None, typer.Option(help="The circle that was commanded: time and poses.")] = None,
    readings: Annotated[
        Path | None, typer.Option(help="Potentiometer: time[s], distance[mm] beyond its length at rest.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the errors here (.png).")] = None,
    json: opt.JsonOption = None,
) -> None:
    """Errors along a drawn circle: outside and inside from the scan, above and below from the readings."""
    from workbench.base.files import write_bytes
    from workbench.data.readers import read_trajectory
    from workbench.paths.pencil.check import plotted_json, plotted_picture, plotted_table, read_drawing

    opt.check_writable(None if picture is None else _png(picture), json)
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


def _png(path: Path) -> Path:
    if path.suffix.lower() != ".png":
        raise OptionError(f"a picture must be a .png file, got {path}")
    return path
