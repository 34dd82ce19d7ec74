"""The commands that look at an arm by itself: redundancy, axes."""

from typing import Annotated

import typer

from workbench.cli.options import (
    DataArgument,
    FileOptions,
    JsonOption,
    RobotOption,
    check_writable,
    flattened,
    say,
    show,
)


def redundancy(
    robot: RobotOption,
    frames: Annotated[bool, typer.Option("--frames", help="With the constants of base and tool.")] = False,
    points: Annotated[
        bool, typer.Option("--points", help="As seen by points alone, without orientation.")
    ] = False,
    free: Annotated[bool, typer.Option("--free", help="Only the constants that the robot frees.")] = False,
    json: JsonOption = None,
) -> None:
    """Which constants of an arm no measurement tells apart, and may be removed."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.identification.redundancy import redundancy as found_of
    from workbench.identification.report.arm import redundancy_json, redundancy_text
    from workbench.report.json import write_json

    arm = load_robot(robot)
    check_writable(json)
    found = found_of(arm, arm.default_free if free else None, frames=frames, points=points)
    show(redundancy_text(arm, found, frames=frames))
    if json is not None:
        say(f"result: {write_json(json, redundancy_json(arm, found))}")


@flattened
def axes(data: DataArgument, robot: RobotOption, files: FileOptions, json: JsonOption = None) -> None:
    """Circle-point analysis: where each joint's axis is, from rows in which it turned alone."""
    from workbench.arm.built_in_arms import load_robot
    from workbench.identification.circle_points import circle_axes
    from workbench.identification.report.arm import axes_json, axes_table
    from workbench.report.json import write_json

    arm = load_robot(robot)
    check_writable(json)
    found = circle_axes(arm, files.read(data, arm))
    show(axes_table(arm, found))
    if json is not None:
        say(f"result: {write_json(json, axes_json(arm, found))}")
