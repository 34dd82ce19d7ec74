"""Command: plate as-measured."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import argument, option
from workbench.cli.plates import PlateArgument


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
