"""Command: hobby map."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.cli import options as opt
from workbench.cli.exit_status import group
from workbench.cli.options import argument, option

hobby = group("hobby", "Servo arms such as SO-101: motors against the URDF.", section="Calibrate")


@hobby.command("map")
@opt.flattened
def map_(
    data: Annotated[
        Path, argument("Motors (counts or degrees) and poses, a row each; or pictures of the board.")
    ],
    robot: opt.RobotOption,
    files: opt.FileOptions,
    save: Annotated[
        Path | None, option("Write the arm whose joints count as the motors do here (.toml or .urdf).")
    ] = None,
) -> None:
    """How motors count against the URDF: direction and zero of each joint, from poses of a printed board."""
    arm = wb.load_robot(robot)
    opt.check_writable(robot=save)
    found = wb.map_motors(arm, files.read(data, arm))
    opt.give(found, save=save, saved="arm with the motors' zeros and signs")
