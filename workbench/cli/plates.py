"""The commands about fixture plates: `workbench plate score` and `workbench plate optimise`."""

from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import argument, option

plates = group("plate", "Fixture plates: score, design, manufacture.")

PlateArgument = Annotated[str, argument("Plate: a .toml file, or the built-in table2.")]
NoiseOption = Annotated[
    str | None,
    option("--noise", 'Standard deviations of the instrument: "0.1mm,0.02deg"; typical ones if not given.'),
]
ToleranceOption = Annotated[
    str | None,
    option('Manufacturing tolerance (±) of holes and blocks: "0.05mm,0.05deg"; default: the plate file.'),
]
PlayOption = Annotated[
    str | None,
    option(
        'Play of the probe in a seat (±): "0.012mm,0.08deg"; pins: that of the drawn g6 pins; none. '
        "Default: the plate file; optimise assumes pins if it states none."
    ),
]


def plate_made(source: str, **given: Any):
    """A plate with the tolerance and the play that are given, the rest as in its file."""
    plate = wb.load_plate(source)
    changed = {name: text for name, text in given.items() if text is not None}
    return replace(plate, production=replace(plate.production, **changed))


@plates.command()
def score(
    plate: PlateArgument,
    robot: opt.RobotOption,
    sigma: NoiseOption = None,
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    unknown: opt.UnknownOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Score a plate: O per target, all observability indices, predicted errors in its region."""
    from workbench.plate.report.plates import score_json

    base, tool = opt.unknown_frames(unknown)
    with opt.progress_bar("score"):
        fixture = plate_made(plate, tolerance=tolerance, play=play)
        found = wb.score(wb.load_robot(robot), fixture, sigma=sigma, seed=seed, base=base, tool=tool)
    opt.show(found.blocks())
    opt.write_result(score_json(found))


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
    from workbench.plate.plate_toml import plate_path
    from workbench.plate.report.design import design_json

    opt.check_writable(plate_path(out))
    base, tool = opt.unknown_frames(unknown)
    given = plate_made(plate, tolerance=tolerance, play=play)
    faces: dict[str, Any] = {"max_tilt": max_tilt}  # texts are read where they are used
    margins: dict[str, Any] = {"clearance": clearance, "errors": errors, "spacing": spacing}
    margins["floor"] = None if floor == "none" else opt.quantity(floor, "floor")
    how: dict[str, Any] = {"kind": kind, "sigma": sigma, "seed": seed, "base": base, "tool": tool}
    how |= {"number": number, "places": places, "production": None if play is None else given.production}
    with opt.progress_bar("optimise"):
        arm, blocks, constraints = wb.load_robot(robot), wb.Blocks(**faces), wb.Constraints(**margins)
        found = wb.optimise_plate(arm, given, blocks=blocks, constraints=constraints, **how)
    opt.show(found.blocks())
    opt.say(f"plate: {wb.write_plate(found.plate, out)}")
    opt.write_result(design_json(found))
    if not isfinite(found.cost):
        opt.fail("these targets leave the arm's position undetermined: give more --targets, or more --tilt")
