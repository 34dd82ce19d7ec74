"""Command that designs a plate: plate optimise."""

from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import (
    NoiseOption,
    PlateArgument,
    PlayOption,
    ToleranceOption,
    plates,
    production_of,
)


@plates.command()
def optimise(
    plate: PlateArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, option("Write the designed plate here (.toml).")],
    targets: Annotated[int | None, option("Number of targets; default: as many as the plate has.")] = None,
    branches: Annotated[str, option("mixed, or single: one branch for all targets.")] = "mixed",
    reading: Annotated[
        str | None,
        option("Reading at a target: seat, socket, point, contacts, ball-bar; as in the plate if not given."),
    ] = None,
    blocks: Annotated[str, option("Blocks: flat, stepped or tilted.")] = "tilted",
    angles: Annotated[str | None, option('The only tilts allowed: "0deg,15deg,30deg"; any if not given.')] = (
        None
    ),
    tilt: Annotated[str, option("Maximum tilt of a block.")] = "45deg",
    shapes: Annotated[
        int | None, option("Maximum number of different blocks, to reduce cost; any if not given.")
    ] = None,
    clearance: Annotated[
        str, option("Minimum clearance of the arm from plate, blocks, table and itself.")
    ] = "10mm",
    errors: Annotated[
        str, option("Maximum manufacturing errors, length and angle, of arms that reach every target.")
    ] = "1mm,0.3deg",
    spacing: Annotated[str, option("Minimum distance between targets on the plate.")] = "80mm",
    floor: Annotated[str, option("Height of the table in the robot's base; none: no table.")] = "0mm",
    noise: NoiseOption = None,
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    places: Annotated[int, option("Number of random blocks at the start of the search.")] = 2500,
    unknown: opt.UnknownOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """The best plate for a region: positions, block angles and branches, reachable and collision-free."""
    from dataclasses import replace

    from workbench.plate import design as plate_design
    from workbench.plate.optimiser.constraints import Constraints
    from workbench.plate.optimiser.optimise import DesignRequest, Postures
    from workbench.plate.optimiser.target_blocks import IN_THE_AIR, Blocks, BlockStyle
    from workbench.plate.report.design import design_json
    from workbench.plate.target_readings import usual_reading

    opt.check_writable(out)
    base, tool = opt.unknown_frames(unknown)
    arm, given = wb.load_robot(robot), wb.load_plate(plate)
    reading = reading or usual_reading(given)
    given = replace(given, production=production_of(given, tolerance, play))
    faces: dict[str, Any] = {"max_tilt": tilt, "tilts": angles or ()}  # texts are read by the records
    margins: dict[str, Any] = {"clearance": clearance, "errors": errors, "spacing": spacing}
    request = DesignRequest(
        number=targets,
        postures=opt.choice_of(Postures, branches, "--branches"),
        blocks=Blocks(
            style=opt.choice_of(BlockStyle, blocks, "--blocks"),
            heights=IN_THE_AIR if reading == "ball-bar" else Blocks().heights,
            **faces,
        ),
        shapes=shapes,
        constraints=Constraints(floor=None if floor == "none" else opt.length(floor), **margins),
        production=None if play is None else given.production,
        places=places,
    )
    choices: dict[str, Any] = {"reading": reading, "sigma": noise, "seed": seed, "base": base, "tool": tool}
    with opt.progress_bar("optimise"):
        found = plate_design.optimise_plate(arm, given, request=request, **choices)
    opt.show(found.blocks())
    opt.say(f"plate: {wb.write_plate(found.plate, out)}")
    opt.write_result(design_json(found))
