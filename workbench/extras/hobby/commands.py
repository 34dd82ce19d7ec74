"""Command: hobby map."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
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
    calibration: Annotated[
        Path | None, option("The arm's LeRobot calibration (.json): names and ranges of its motors.")
    ] = None,
    percent: Annotated[
        bool, option("--percent", "Motors are in −100 … 100 % of their range; needs --calibration.")
    ] = False,
    make: Annotated[str, option("Make of the motors: feetech (SO-101), or dynamixel (Koch).")] = "feetech",
    lerobot: Annotated[
        Path | None, option("Write the LeRobot calibration with these zeros here (.json).")
    ] = None,
    save: Annotated[
        Path | None, option("Write the arm whose joints count as the motors do here (.toml or .urdf).")
    ] = None,
    json: opt.JsonOption = None,
) -> None:
    """How motors count against the URDF: direction and zero of each joint, from poses of a printed board."""
    from workbench.base.files import read_bytes, write_text
    from workbench.extras.hobby.lerobot import Make, as_angles, read_motors, with_zeros

    arm = wb.load_robot(robot)
    chosen = opt.choice_of(Make, make, "--make")
    if (lerobot is not None or percent) and calibration is None:
        raise OptionError("--lerobot and --percent need --calibration FILE, the arm's calibration as it is")
    opt.check_robot_file(save)
    opt.check_writable(lerobot, save, json)
    text, known = "", None
    if calibration is not None:
        text = read_bytes(calibration, wanted="a LeRobot calibration (.json)").decode(errors="replace")
        known = read_motors(text, arm.dof, path=str(calibration))
    found = wb.map_motors(
        arm,
        as_angles(files.read(data, arm), known, percent=percent),
        motors=() if known is None else tuple(motor.name for motor in known),
    )
    if lerobot is not None and found.exchanged:
        names = " and ".join(found.exchanged)
        raise OptionError(f"{names} are exchanged: exchange their ids with LeRobot first")
    zeroed = with_zeros(text, found.zeros.tolist(), chosen) if lerobot is not None else ""
    opt.give(found, json)
    if save is not None:
        opt.say(f"arm with the motors' zeros and signs: {opt.save_robot(found.robot, save)}")
    if lerobot is not None:
        opt.say(f"LeRobot calibration: {write_text(lerobot, zeroed)}")
        if found.reversed:
            names = ", ".join(found.reversed)
            opt.say(f"LeRobot's degrees can't reverse {names}: change their sign, or use the arm of --save")
