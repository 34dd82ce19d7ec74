"""Command that designs a plate: plate optimise."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import PlateArgument, PlayOption, ToleranceOption, plates, production_of, sigma_of


@dataclass(frozen=True)
class BlockOptions:
    """Options for the blocks of a designed plate."""

    blocks: Annotated[str, option("Blocks: flat, stepped or tilted.")] = "tilted"
    heights: Annotated[str | None, option('Heights of blocks: "40mm,120mm".')] = None
    angles: Annotated[str | None, option('The only tilts allowed: "0deg,15deg,30deg"; any if not given.')] = (
        None
    )
    tilt: Annotated[str, option("Maximum tilt of a block.")] = "45deg"
    turn: Annotated[str, option("Blocks are rotated in multiples of this angle; 0deg: any angle.")] = "0deg"

    def of(self, reading: str):
        """The same in SI, for targets with this reading."""
        from workbench.plate.optimiser.target_blocks import IN_THE_AIR, Blocks, BlockStyle

        usual = IN_THE_AIR if reading == "ball-bar" else Blocks().heights
        return Blocks(
            style=opt.choice_of(BlockStyle, self.blocks, "--blocks"),
            heights=usual if self.heights is None else opt.two_lengths(self.heights, "--heights"),
            max_tilt=opt.angle(self.tilt),
            tilts=() if self.angles is None else tuple(opt.angle(part) for part in self.angles.split(",")),
            turn=opt.angle(self.turn),
        )


@dataclass(frozen=True)
class MarginOptions:
    """Options for the margins of a designed plate."""

    clearance: Annotated[
        str, option("Minimum clearance of the arm from plate, blocks, table and itself.")
    ] = "10mm"
    limit_margin: Annotated[str, option("Minimum distance of joints from their limits.")] = "10deg"
    errors: Annotated[
        str, option("Maximum manufacturing errors, length and angle, of arms that reach every target.")
    ] = "1mm,0.3deg"
    spacing: Annotated[str, option("Minimum distance between targets on the plate.")] = "80mm"
    retreat: Annotated[str, option("Distance over which the probe must be able to retract.")] = "50mm"
    floor: Annotated[str, option("Height of the table in the robot's base; none: no table.")] = "0mm"

    def constraints(self):
        """The same in SI."""
        from workbench.plate.optimiser.constraints import Constraints

        return Constraints(
            clearance=opt.length(self.clearance),
            limit_margin=opt.angle(self.limit_margin),
            errors=opt.pair_of(self.errors, "--errors"),
            spacing=opt.length(self.spacing),
            retreat=opt.length(self.retreat),
            floor=None if self.floor == "none" else opt.length(self.floor),
        )


@plates.command()
@opt.flattened
def optimise(
    plate: PlateArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, option("Write the designed plate here (.toml).")],
    block_options: BlockOptions,
    margins: MarginOptions,
    targets: Annotated[int | None, option("Number of targets; default: as many as the plate has.")] = None,
    branches: Annotated[str, option("mixed, or single: one branch for all targets.")] = "mixed",
    reading: Annotated[
        str | None,
        option("Reading at a target: seat, socket, point, contacts, ball-bar; as in the plate if not given."),
    ] = None,
    shapes: Annotated[
        int | None, option("Maximum number of different blocks, to reduce cost; any if not given.")
    ] = None,
    noise: Annotated[
        str | None, option('Standard deviations of one reading: "0.1mm,0.02deg"; typical ones if not given.')
    ] = None,
    visits: Annotated[int, option("Number of visits to each target.")] = 1,
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    places: Annotated[int, option("Number of random blocks at the start of the search.")] = 2500,
    unknown: opt.UnknownOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """The best plate for a region: positions, block angles and branches, reachable and collision-free."""
    from dataclasses import replace

    from workbench.plate import design as plate_design
    from workbench.plate.optimiser.optimise import DesignRequest, Postures
    from workbench.plate.report.design import design_json
    from workbench.plate.target_readings import usual_reading

    opt.check_writable(out)
    base, tool = opt.unknown_frames(unknown)
    arm, given = wb.load_robot(robot), wb.load_plate(plate)
    reading = reading or usual_reading(given)
    given = replace(given, production=production_of(given, tolerance, play))
    request = DesignRequest(
        number=targets,
        postures=opt.choice_of(Postures, branches, "--branches"),
        blocks=block_options.of(reading),
        shapes=shapes,
        constraints=margins.constraints(),
        production=None if play is None else given.production,
        places=places,
    )
    with opt.progress_bar("optimise"):
        found = plate_design.optimise_plate(
            arm,
            given,
            request=request,
            reading=reading,
            sigma=sigma_of(noise),
            visits=visits,
            seed=seed,
            base=base,
            tool=tool,
        )
    opt.show(found.blocks())
    opt.say(f"plate: {wb.write_plate(found.plate, out)}")
    opt.write_result(design_json(found))
