"""Commands: plate yield, plate tradeoff."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import PlateArgument, PlayOption, ToleranceOption, production_of, sigma_of


def yield_(
    plate: PlateArgument,
    robot: opt.RobotOption,
    arms: Annotated[int, option("Number of virtual arms.")] = 10_000,
    noise: Annotated[
        str | None, option('Repeatability and reading of a target: "0.1mm,0.02deg"; typical ones by default.')
    ] = None,
    joint_noise: Annotated[str, option("Standard deviation of the joint readings.")] = "0deg",
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    effects_of: Annotated[
        str | None, option("--effects-of", "Robot file with undeclared effects of the actual arms.")
    ] = None,
    errors: Annotated[
        str, option("Maximum manufacturing errors of the arms: length and angle.")
    ] = "1mm,0.3deg",
    orientations: Annotated[
        str | None, option("Evaluate near the orientations of this plate's targets, to compare plates.")
    ] = None,
    poses: Annotated[int, option("Number of poses of the region at which arms are evaluated.")] = 500,
    scheduler: opt.SchedulerOption = None,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """How many arms of a production run meet the requirement after calibration with the plate."""
    from workbench.extras.production.plate_trial import try_plate
    from workbench.extras.production.report import yield_json, yield_tables

    opt.check_writable(json)
    length, angle = opt.pair_of(errors, "--errors")
    fixture = wb.load_plate(plate)
    with opt.progress_bar("yield"):
        found = try_plate(
            wb.load_robot(robot),
            fixture,
            arms=arms,
            sigma=sigma_of(noise),
            joint_sigma=opt.angle(joint_noise),
            production=production_of(fixture, tolerance, play),
            undeclared=() if effects_of is None else wb.load_robot(effects_of).effects,
            length=length,
            angle=angle,
            towards=None if orientations is None else wb.load_plate(orientations),
            poses=poses,
            scheduler=scheduler,
            seed=seed,
        )
    opt.show(yield_tables(found))
    opt.write_result(json, yield_json(found))


def tradeoff(
    plate: PlateArgument,
    robot: opt.RobotOption,
    out: Annotated[Path, option("Folder for the plot and a plate (.toml) for each option.")],
    targets: Annotated[str, option("Numbers of targets.")] = "8,12,16",
    made: Annotated[str, option("Manufacturing methods.")] = "machined,printed,breadboard",
    places: Annotated[int, option("Number of random blocks at the start of each search.")] = 500,
    arms: Annotated[int, option("Number of virtual arms to try each plate on; 0: none.")] = 0,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Predicted error by number of targets, block shapes and manufacturing method."""
    from workbench.base.files import write_folder
    from workbench.extras.production.tradeoff import weigh_choices
    from workbench.plate.plate_toml import plate_text
    from workbench.report.figures import png

    opt.check_writable(json, folder=out)
    with opt.progress_bar("tradeoff"):
        found = weigh_choices(
            wb.load_robot(robot),
            wb.load_plate(plate),
            numbers=opt.whole_numbers(targets, "--targets"),
            methods=tuple(name.strip() for name in made.split(",")),
            places=places,
            arms=arms,
            seed=seed,
        )
    opt.show(found.summary())
    files = {f"{c.name.replace(', ', '-').replace(' ', '-')}.toml": c.design.plate for c in found.choices}
    written = {name: plate_text(each).encode() for name, each in files.items()}
    opt.say(
        f"picture and {len(files)} plates: {write_folder(out, written | {'tradeoff.png': png(found.plot())})}"
    )
    opt.write_result(json, found.json())
