"""Command that designs a plate: plate optimise."""

from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import NoiseOption, PlateArgument, PlayOption, ToleranceOption, plate_made, plates


@plates.command()
def optimise(
    plate: PlateArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, option("Write the designed plate here (.toml).")],
    number: Annotated[
        int | None, option("--targets", "Number of targets; default: as many as the plate has.")
    ] = None,
    kind: Annotated[
        str | None, option("What a target is: seat, socket or point; as in the plate if not given.")
    ] = None,
    max_tilt: Annotated[str, option("--tilt", "Maximum tilt of a block; 0deg: flat blocks.")] = "45deg",
    clearance: Annotated[
        str, option("Minimum clearance of the arm from plate, blocks, table and itself.")
    ] = "10mm",
    errors: Annotated[
        str, option("Maximum manufacturing errors, length and angle, of arms that reach every target.")
    ] = "1mm,0.3deg",
    spacing: Annotated[str, option("Minimum distance between targets on the plate.")] = "80mm",
    floor: Annotated[str, option("Height of the table in the robot's base; none: no table.")] = "0mm",
    sigma: NoiseOption = None,
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    places: Annotated[int, option("Number of random blocks at the start of the search.")] = 1500,
    unknown: opt.UnknownOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """The best plate for a region: positions, block angles and branches, reachable and collision-free."""
    from workbench.plate.design import optimise_plate
    from workbench.plate.optimiser.constraints import Constraints
    from workbench.plate.optimiser.target_blocks import Blocks
    from workbench.plate.plate_toml import plate_path
    from workbench.plate.report.design import design_json

    opt.check_writable(plate_path(out))
    base, tool = opt.unknown_frames(unknown)
    given = plate_made(plate, tolerance=tolerance, play=play)
    faces: dict[str, Any] = {"max_tilt": max_tilt}  # texts are read where they are used
    margins: dict[str, Any] = {"clearance": clearance, "errors": errors, "spacing": spacing}
    margins["floor"] = None if floor == "none" else opt.quantity(floor, "floor")
    how: dict[str, Any] = {"kind": kind, "sigma": sigma, "seed": seed, "base": base, "tool": tool}
    with opt.progress_bar("optimise"):
        found = optimise_plate(
            wb.load_robot(robot),
            given,
            number=number,
            blocks=Blocks(**faces),
            constraints=Constraints(**margins),
            production=None if play is None else given.production,
            places=places,
            **how,
        )
    opt.show(found.blocks())
    opt.say(f"plate: {wb.write_plate(found.plate, out)}")
    opt.write_result(design_json(found))
    if not isfinite(found.cost):
        opt.fail("these targets leave the arm's position undetermined: give more --targets, or more --tilt")
