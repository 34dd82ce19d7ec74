"""Command: plate yield."""

from dataclasses import replace
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import NoiseOption, PlateArgument, PlayOption, ToleranceOption, production_of


def yield_(
    plate: PlateArgument,
    robot: opt.RobotOption,
    arms: Annotated[int, option("Number of virtual arms.")] = 10_000,
    noise: NoiseOption = None,
    joint_noise: Annotated[str, option("Standard deviation of the joint readings.")] = "0deg",
    tolerance: ToleranceOption = None,
    play: PlayOption = None,
    errors: Annotated[
        str, option("Maximum manufacturing errors of the arms: length and angle.")
    ] = "1mm,0.3deg",
    poses: Annotated[int, option("Number of poses of the region at which arms are evaluated.")] = 500,
    scheduler: opt.SchedulerOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """How many arms of a production run meet the requirement after calibration with the plate."""
    from workbench.extras.production.plate_trial import try_plate

    given = wb.load_plate(plate)
    with opt.progress_bar("yield"):
        found = try_plate(
            wb.load_robot(robot),
            replace(given, production=production_of(given, tolerance, play)),
            arms=arms,
            sigma=noise,
            joint_sigma=opt.angle(joint_noise),
            errors=opt.pair_of(errors, "--errors"),
            poses=poses,
            scheduler=scheduler,
            seed=seed,
        )
    opt.give(found)
