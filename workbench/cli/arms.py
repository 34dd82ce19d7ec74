"""The command `new`, for your own robot."""

from pathlib import Path
from typing import Annotated

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.options import argument, option


def new(
    source: Annotated[str, argument("A DH table (.csv), a .urdf, a .xacro (name:=value …), or a known arm.")],
    out: Annotated[Path, option("Write the robot here (.toml).")],
    pose: Annotated[
        list[str] | None,
        option(
            "A pose as shown on the pendant, flange in the robot's base: "
            '"q1,…,qn = x,y,z,a,b,c" (angles, or a quaternion); give three or more. Units are detected.'
        ),
    ] = None,
    poses: Annotated[
        Path | None, option("The same as a measurement file, with units in the headings.")
    ] = None,
    name: Annotated[str | None, option("Name of the robot.")] = None,
    apply: Annotated[
        Path | None, option("With --for: a file of the arm's controller or driver to import.")
    ] = None,
    form: Annotated[str | None, option("--for", "With --apply: its form, such as ur-calibration.")] = None,
    tip: opt.TipOption = None,
    json: opt.JsonOption = None,
) -> None:
    """Your own robot: signs, offsets, units and convention determined from three pendant poses."""
    from dataclasses import replace

    from workbench.arm.built_in_arms import check_robot_file, save_robot
    from workbench.arm.own_robot.check import check_robot, convention_notes

    if (apply is None) != (form is None):
        raise OptionError("--apply FILE and --for NAME belong together")
    if apply is None and not pose and poses is None:
        raise OptionError(
            'at least three poses are needed to check a robot: --pose "q1,…,qn = x,y,z,roll,pitch,yaw" for '
            "each, or --poses FILE"
        )
    check_robot_file(out)
    opt.check_writable(out, json)
    content: dict = {"schema": "workbench.robot/1", "file": str(out)}
    if apply is not None and form is not None:
        arm = _applied(wb.load_robot(source, tip=tip), apply, form)
    else:
        found = check_robot(source, pose or [] if poses is None else _poses(source, poses, tip), tip=tip)
        arm = found.robot
        for text in convention_notes(found):
            opt.say(text)
        content |= {"words": list(found.assumptions), "changes": list(found.changes), "tried": found.tried}
        content |= {"position_m": found.position, "rotation_rad": found.rotation}
    arm = replace(arm, name=name or arm.name)
    opt.say(f"{arm.name}: {save_robot(arm, out)}")
    opt.write_result(json, content)


def _applied(nominal, path: Path, form: str):
    """A known arm with the calibration stored in its controller or driver."""
    from workbench.exports import Job, form_named
    from workbench.identification.arm_match import require_same_arm

    text = form_named(form).text_of(path)
    arm = form_named(form).read(text, Job(robot=nominal, nominal=nominal, source=text))
    if arm is None:
        raise OptionError(f"files of the form {form} can't be imported; use the calibration's TOML instead")
    require_same_arm(arm, nominal)
    return arm


def _poses(source: str, path: Path, tip: str | None):
    """Poses of a measurement file, whose headings tell the units."""
    from workbench.arm.own_robot.check import readings_of
    from workbench.arm.own_robot.readings import Typed
    from workbench.base import se3

    data = wb.read_measurements(path, joints=readings_of(source, tip=tip)[0].robot.joint_names)
    if data.position is None or data.rotation is None:
        raise OptionError(f"{path}: full poses are needed, position and orientation")
    return Typed(data.q, se3.pose(data.rotation, data.position))
