"""Command: loading."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Calibrate")
def loading(
    robot: Annotated[str, argument("Robot with masses: a .toml file, or a built-in arm.")],
    added_mass: Annotated[float, option("Mass that can be attached to the tool [kg].")] = 0.0,
    pairs: Annotated[int, option("Pairs of postures for each joint and purpose.")] = 4,
    centre_tolerance: Annotated[
        str, option("Standard deviation of the links' centres of mass along each axis.")
    ] = "2mm",
    out: Annotated[Path | None, option("Write the postures with the virtual readings here (.csv).")] = None,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Postures in which inclinometers reveal clearance, backlash and stiffness, tried on a virtual arm."""
    from workbench.extras.katana.load_test.experiment import run_load_test

    opt.check_writable(json, out)
    found = run_load_test(
        wb.load_robot(robot),
        added_mass=added_mass,
        each=pairs,
        centre_tolerance=opt.length(centre_tolerance),
        seed=seed,
    )
    opt.give(found, json)
    if out is not None:
        opt.say(f"postures, readings: {wb.write_measurements(found.data, out)}")
