"""Commands: redundancy, axes."""

from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import option


@in_section("Calibrate")
def redundancy(
    robot: opt.RobotOption,
    frames: Annotated[bool, option("--frames", "Include the constants of base and tool.")] = False,
    points: Annotated[bool, option("--points", "Measured by points only, without orientation.")] = False,
    free: Annotated[bool, option("--free", "Only the robot's free constants.")] = False,
    json: opt.JsonOption = None,
) -> None:
    """Constants of an arm that no measurement can separate, and which of them may be removed."""
    from workbench.extras.geometry.redundant_constants import redundancy as found_of
    from workbench.extras.geometry.report import redundancy_json, redundancy_text

    arm = wb.load_robot(robot)
    opt.check_writable(json)
    found = found_of(arm, arm.default_free if free else None, frames=frames, points=points)
    opt.show(redundancy_text(arm, found, frames=frames))
    opt.write_result(json, redundancy_json(arm, found))


@in_section("Calibrate")
@opt.flattened
def axes(
    data: opt.DataArgument, robot: opt.RobotOption, files: opt.FileOptions, json: opt.JsonOption = None
) -> None:
    """Circle-point analysis: locate each joint's axis from rows in which only that joint moved."""
    from workbench.extras.geometry.circle_points import circle_axes
    from workbench.extras.geometry.report import axes_json, axes_table

    arm = wb.load_robot(robot)
    opt.check_writable(json)
    found = circle_axes(arm, files.read(data, arm))
    opt.show(axes_table(arm, found))
    opt.write_result(json, axes_json(arm, found))
