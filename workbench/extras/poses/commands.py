"""Command: poses."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import option


@in_section("Calibrate")
def poses(
    robot: opt.RobotOption,
    number: Annotated[int, option("Number of poses.")],
    index: Annotated[
        str, option("Index to maximise: O, O1 … O5, A, D, or I (predicted error in the region).")
    ] = "O1",
    candidates: Annotated[Path | None, option("--from", "Choose from the rows of this file.")] = None,
    region: Annotated[
        str | None, option('Region for the tool: a plate\'s region, or "x,y,z:x,y,z" in m.')
    ] = None,
    towards: Annotated[
        str | None, option('Preferred tool orientation: "roll,pitch,yaw" in degrees, or a plate.')
    ] = None,
    cone: Annotated[str, option("With --towards: maximum deviation from it.")] = "60deg",
    margin: Annotated[str, option("Minimum distance of revolute joints from their limits.")] = "0deg",
    spread: Annotated[str, option("Minimum distance between tool positions.")] = "0mm",
    travel: Annotated[str | None, option("Maximum travel of any joint from one pose to the next.")] = None,
    method: Annotated[str, option("Search: exchange, or greedy (without exchanges).")] = "exchange",
    unknown: opt.UnknownOption = None,
    out: Annotated[Path | None, option("Write the joint positions here (.csv).")] = None,
    json: opt.JsonOption = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Informative poses for a calibration, with a large observability index, ordered for short travel."""
    from workbench.extras.poses.choose_poses import choose_poses, poses_json, poses_table, write_poses
    from workbench.extras.poses.pose_limits import PoseLimits

    arm = wb.load_robot(robot)
    limits = PoseLimits(
        region=None if region is None else opt.region_of(region),
        towards=None if towards is None else opt.orientations_of(towards),
        cone=opt.angle(cone),
        margin=opt.angle(margin),
        spread=opt.length(spread),
        travel=None if travel is None else opt.angle(travel),
    )
    base, tool = opt.unknown_frames(unknown)
    opt.check_writable(out, json)
    with opt.progress_bar("poses"):
        found = choose_poses(
            arm,
            number,
            index=index,
            seed=seed,
            candidates=candidates,
            limits=limits,
            method=method,
            base=base,
            tool=tool,
        )
    opt.show(poses_table(arm, found))
    if out is not None:
        opt.say(f"poses: {write_poses(arm, found, out)}")
    opt.write_result(json, poses_json(arm, found))
