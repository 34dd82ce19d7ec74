"""The commands that make a plate and take it back as it was measured: plate export, plate as-measured."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.options import check_writable, noise_of, progress_bar, say
from workbench.cli.plates import NoiseOption, PlateArgument


def export(
    plate: PlateArgument,
    out: Annotated[Path, typer.Option(help="Folder for the files; made if it is not there.")],
    formats: Annotated[
        str, typer.Option(help="What to write: stl, 3mf, dxf, csv, sheet, step, with commas between.")
    ] = "stl,3mf,dxf,csv,sheet",
    robot: Annotated[
        str | None, typer.Option(help="Arm for which the sheet says what accuracy to expect.")
    ] = None,
    noise: NoiseOption = "0.1mm,0.02deg",
) -> None:
    """Everything to make a plate: solids, hole drawing, lists, and a sheet with the expected accuracy."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.plate.parts import export as plate_making
    from workbench.plate.parts.as_measured import load_plate

    wanted = plate_making.formats_named(formats)
    check_writable(folder=out)
    sigma = noise_of(noise)
    with progress_bar("plate") as progress:
        fixture, files = plate_making.export_plate(
            load_plate(plate),
            out,
            formats=wanted,
            robot=None if robot is None else load_robot(robot),
            sigma=(sigma.position, sigma.rotation),
            progress=progress,
        )
    shapes = ", ".join(f"{len(shape.numbers)} × {shape.letter}" for shape in fixture.shapes)
    say(f"{fixture.name}: plate and {len(fixture.blocks)} blocks ({shapes}) in {out}")
    for note in fixture.notes:
        say(f"note: {note}")
    say(f"files: {', '.join(path.name for path in files)}")


def as_measured(
    plate: PlateArgument,
    measured: Annotated[
        Path, typer.Argument(help="Table of a measuring machine: target, x[mm] …, roll[deg] ….")
    ],
    out: Annotated[Path, typer.Option(help="Write the plate with its measured targets here (.toml).")],
    frame: Annotated[
        str, typer.Option(help="Measured in the frame of the robot's base, or of the plate (its top centre).")
    ] = "base",
) -> None:
    """The plate as it came out: measured targets in place of the drawn ones; region and branches stay."""
    from workbench.plate.parts.as_measured import as_measured as replaced
    from workbench.plate.parts.as_measured import frame_named, read_measured_targets
    from workbench.plate.plate_toml import load_plate, write_plate

    chosen = frame_named(frame)
    check_writable(out)
    found = replaced(load_plate(plate), read_measured_targets(measured), frame=chosen)
    for note in found.notes:
        say(f"note: {note}")
    say(f"plate: {write_plate(found, out)}")
