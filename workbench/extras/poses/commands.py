"""Command: poses."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.joined_options import AbstractAim
from workbench.cli.options import option


@dataclass(frozen=True)
class SightOptions:
    """What an instrument must see of poses; all options come from other packages."""

    joined: tuple[AbstractAim, ...] = ()
    joins: ClassVar = AbstractAim

    @property
    def sight(self):
        """What must be visible; None for no condition."""
        return next((found for aim in self.joined if (found := aim.sight()) is not None), None)


@in_section("Calibrate")
@opt.flattened
def poses(
    robot: opt.RobotOption,
    number: Annotated[int, option("Number of poses.")],
    seen: SightOptions,
    index: Annotated[
        str | None,
        option(
            "Index to maximise: O, O1 … O5, A, D, or I (predicted error in the region); "
            "O1 if not given, Ov1 for a camera."
        ),
    ] = None,
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
    view = seen.sight
    limits = PoseLimits(
        view=view,
        clearance=None if view is None else 0.0,
        region=None if region is None else opt.region_of(region),
        towards=None if towards is None else opt.orientations_of(towards),
        cone=opt.angle(cone),
        margin=opt.angle(margin),
        spread=opt.length(spread),
        travel=None if travel is None else opt.angle(travel),
    )
    index = index or ("O1" if view is None else "Ov1")
    base, tool = opt.unknown_frames("base,tool" if view is not None and unknown is None else unknown)
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
