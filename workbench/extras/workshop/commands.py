"""Commands: plate export and plate as-measured."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.cli import options as opt
from workbench.cli.options import argument, option
from workbench.cli.plates import PlateArgument, ToleranceOption, plate_made

EXPORT, MEASURED = "workbench.plate-export/1", "workbench.plate-as-measured/1"


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
    from workbench.extras.workshop.as_measured import PlateFrame
    from workbench.extras.workshop.as_measured import as_measured as replaced
    from workbench.plate.measured_plate import read_measured_targets
    from workbench.plate.plate_toml import plate_path, plate_to_table
    from workbench.report.json import document

    chosen = opt.choice_of(PlateFrame, frame, "--frame")
    opt.check_writable(plate_path(out))
    found = replaced(
        wb.load_plate(plate), read_measured_targets(measured, uncertainty=uncertainty), frame=chosen
    )
    opt.say_notes(found.notes)
    opt.say(f"plate: {wb.write_plate(found, out)}")
    targets = plate_to_table(found)["target"]
    opt.write_result(document(MEASURED, plate=found.name, targets=targets, notes=found.notes))


def export(
    plate: PlateArgument,
    out: Annotated[Path, option("Folder for the files; made if it is not there.")],
    formats: Annotated[
        str | None, option("What to write, such as stl,csv (another name lists all); all by default.")
    ] = None,
    tolerance: ToleranceOption = None,
) -> None:
    """Export what is needed to make a plate: its drawing, solids of all parts, and the list of targets."""
    from workbench.extras.workshop.outputs import parts_of
    from workbench.plate.export import OWN_FILE, export_plate, formats_named
    from workbench.report.json import document

    wanted = () if formats is None else formats_named(formats)
    opt.check_writable(folder=out)
    if (out / OWN_FILE).resolve() == Path(plate).resolve() and "toml" in (wanted or ("toml",)):
        raise OptionError(f"{plate} would be replaced: choose another folder, or --formats without toml")
    given = plate_made(plate, tolerance=tolerance)
    with opt.progress_bar("plate"):
        fixture = parts_of(given)
        files, missing, _ = export_plate(given, out, formats=wanted)
    shapes = {letter: len(alike) for letter, alike in fixture.shapes.items()}
    names, each = [path.name for path in files], ", ".join(f"{n} × {k}" for k, n in shapes.items())
    opt.say(f"{given.name}: plate and {plural(len(fixture.blocks), 'block')} ({each}) in {out}")
    opt.say_notes(fixture.notes)
    opt.say(f"files: {', '.join(names)}")
    for kind, why in missing.items():
        opt.say(f"not written: {kind}; {why}")
    found = {"plate": given.name, "shapes": shapes, "files": names, "missing": missing}
    opt.write_result(document(EXPORT, **found, notes=fixture.notes))
    if missing and formats is not None:
        opt.fail(f"{', '.join(missing)} could not be written")
