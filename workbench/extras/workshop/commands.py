"""Commands: plate export and plate as-measured."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.options import argument, option
from workbench.cli.plates import NoiseOption, PlateArgument, ToleranceOption, production_of, sigma_of


def as_measured(
    plate: PlateArgument,
    measured: Annotated[Path, argument("Table of a measuring machine: target, x[mm] …, roll[deg] ….")],
    out: Annotated[Path, option("Write the plate with its measured targets here (.toml).")],
    frame: Annotated[
        str, option("Measured in the frame of the robot's base, or of the plate (its top centre).")
    ] = "base",
    uncertainty: Annotated[
        str, option("Standard deviation of the machine, if its table has no sigma columns.")
    ] = "0.005mm,0.01deg",
) -> None:
    """The plate as manufactured: measured targets replace the drawn ones; region and branches stay."""
    from workbench.extras.workshop.as_measured import as_measured as replaced
    from workbench.extras.workshop.as_measured import frame_named
    from workbench.plate.measured_plate import read_measured_targets
    from workbench.plate.plate_toml import load_plate

    chosen = frame_named(frame)
    opt.check_writable(out)
    found = replaced(
        load_plate(plate),
        read_measured_targets(measured, uncertainty=opt.pair_of(uncertainty, "--uncertainty")),
        frame=chosen,
    )
    opt.say_notes(found.notes)
    opt.say(f"plate: {wb.write_plate(found, out)}")


def export(
    plate: PlateArgument,
    out: Annotated[Path, option("Folder for the files; made if it is not there.")],
    formats: Annotated[
        str | None, option("What to write, such as stl,csv (another name lists all); all usual ones.")
    ] = None,
    robot: Annotated[str | None, option("Arm for which the sheet states the expected accuracy.")] = None,
    noise: NoiseOption = None,
    tolerance: ToleranceOption = None,
    made: Annotated[str, option("Made how: machined, printed, breadboard or ball-bar.")] = "machined",
    printed: Annotated[bool, option("--printed", "The same as --made printed.")] = False,
) -> None:
    """Export all that is needed to make a plate: drawings, solids, lists, and the expected accuracy."""
    from workbench.extras.workshop.fixture import fixture_of
    from workbench.plate.export import OWN_FILE, export_plate, formats_named
    from workbench.plate.optimiser.manufacturing import METHODS
    from workbench.plate.stock import Stock

    wanted = () if formats is None else formats_named(formats)
    opt.check_writable(folder=out)
    if (out / OWN_FILE).resolve() == Path(plate).resolve() and "toml" in (wanted or ("toml",)):
        raise OptionError(f"{plate} would be replaced: choose another folder, or --formats without toml")
    given, made = wb.load_plate(plate), "printed" if printed else made
    opt.choice_of(METHODS, made, "--made")
    given, stock = replace(given, production=production_of(given, tolerance, None)), Stock.named(made)
    arm = None if robot is None else wb.load_robot(robot)
    fixture = fixture_of(given, stock=stock, robot=arm)
    with opt.progress_bar("plate"):
        files, missing, _ = export_plate(
            given, out, formats=wanted, robot=arm, sigma=sigma_of(noise), stock=stock
        )
    shapes = ", ".join(f"{len(shape.numbers)} × {shape.letter}" for shape in fixture.shapes)
    opt.say(f"{fixture.name}: plate and {plural(len(fixture.blocks), 'block')} ({shapes}) in {out}")
    opt.say_notes(fixture.notes)
    opt.say(f"drawn for {fixture.tolerances.note}")
    opt.say(f"files: {', '.join(path.name for path in files)}")
    for kind, why in missing.items():
        opt.say(f"not written: {kind}; {why}")
    if missing and formats is not None:
        opt.fail(f"{', '.join(missing)} could not be written")
