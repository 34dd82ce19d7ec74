"""The commands that choose poses: poses, plate cluster."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import option


@in_section("Calibrate")
def poses(
    robot: opt.RobotOption,
    number: Annotated[int, option("Number of poses.")],
    index: Annotated[
        str, option("Index to maximise: O, O1 … O5, or I (predicted error in the region).")
    ] = "O1",
    candidates: Annotated[Path | None, option("--from", "Choose from the rows of this file.")] = None,
    region: Annotated[str | None, option("Region for the tool: that of this plate.")] = None,
    margin: Annotated[str, option("Minimum distance of revolute joints from their limits.")] = "0deg",
    clearance: Annotated[str | None, option("Minimum distance from itself and the table.")] = None,
    unknown: opt.UnknownOption = None,
    out: Annotated[Path | None, option("Write the joint positions here (.csv).")] = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Informative poses for a calibration, with a large observability index."""
    from workbench.extras.poses.choose_poses import choose_poses, poses_blocks, poses_json, write_poses
    from workbench.extras.poses.pose_limits import PoseLimits

    arm = wb.load_robot(robot)
    margins: dict[str, Any] = {"margin": margin, "clearance": clearance}
    limits = PoseLimits(region=None if region is None else wb.load_plate(region).region, **margins)
    base, tool = opt.unknown_frames(unknown)
    opt.check_writable(out)
    with opt.progress_bar("poses"):
        found = choose_poses(
            arm, number, index=index, candidates=candidates, limits=limits, base=base, tool=tool, seed=seed
        )
    opt.show(poses_blocks(arm, found))
    if clearance is None:
        opt.say("note: not checked whether the arm runs into itself or its table; --clearance 10mm does")
    if out is not None:
        opt.say(f"poses: {write_poses(arm, found, out)}")
    opt.write_result(poses_json(arm, found))


def cluster(
    robot: opt.RobotOption,
    region: Annotated[str, option("A plate whose region to use.")] = "table2",
    cube: Annotated[str | None, option("--side", "Side of the cubes; the plate's if not given.")] = None,
    number: Annotated[int, option("Number of poses.")] = 10,
    index: Annotated[
        str, option("Criterion for choosing between sets of equal O: I (predicted error), O1 … O5.")
    ] = "I",
    out: Annotated[Path | None, option("Write the poses as a plate here (.toml).")] = None,
    seed: opt.SeedOption = 0,
) -> None:
    """Workspace clustering: poses with equal O in different cubes of a region, the best such set."""
    from workbench.extras.poses.cluster_report import cluster_blocks, cluster_json
    from workbench.extras.poses.clustering import cluster_region
    from workbench.plate.plate_toml import plate_path

    opt.check_writable(None if out is None else plate_path(out))
    arm = wb.load_robot(robot)
    side: dict[str, Any] = {} if cube is None else {"cube": cube}  # texts are read where they are used
    cuboid = replace(wb.load_plate(region).region, **side)
    with opt.progress_bar("cluster"):
        found = cluster_region(arm, cuboid, number=number, index=index, seed=seed)
    opt.show(cluster_blocks(found))
    if out is not None:
        opt.say(f"plate: {wb.write_plate(found.plate(), out)}")
    opt.write_result(cluster_json(found))
