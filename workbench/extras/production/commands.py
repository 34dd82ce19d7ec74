"""Command: plate yield."""

from typing import Annotated, Any

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.options import option
from workbench.cli.plates import NoiseOption, PlateArgument, PlayOption, ToleranceOption, plate_made


def yield_(
    plate: PlateArgument,
    robot: opt.RobotOption,
    arms: Annotated[int, option("Number of virtual arms.")] = 10_000,
    sigma: NoiseOption = None,
    joint_sigma: Annotated[str, option("--joint-noise", "Standard deviation of joint readings.")] = "0deg",
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

    how: dict[str, Any] = {"sigma": sigma, "joint_sigma": joint_sigma, "errors": errors}
    with opt.progress_bar("yield"):
        found = try_plate(
            wb.load_robot(robot),
            plate_made(plate, tolerance=tolerance, play=play),
            arms=arms,
            poses=poses,
            scheduler=scheduler,
            seed=seed,
            **how,
        )
    opt.give(found)
