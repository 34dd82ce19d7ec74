"""Commands: new, extract, tcp, frame."""

from pathlib import Path
from typing import Annotated, Any

import workbench as wb
from workbench.base.errors import OptionError
from workbench.cli import options as opt
from workbench.cli.exit_status import in_section
from workbench.cli.options import argument, option


@in_section("Calibrate")
def extract(
    robot: opt.RobotOption,
    readings: Annotated[
        Path | None, argument("Joints and tool poses as the pendant shows, a line each, or a log with both.")
    ] = None,
    pose: Annotated[
        list[str] | None, option('A pose instead of the file: "q1,…,qn = x,y,z,a,b,c". May be repeated.')
    ] = None,
    rows: Annotated[Path | None, option("Write the readings as measurements here, for diagnose.")] = None,
    save: opt.SaveOption = None,
    reading: opt.ReadingOption = "auto",
    *,
    files: opt.FileOptions,
) -> None:
    """Extract the controller's calibrated model from joints and tool poses on its pendant."""
    if (readings is None) == (not pose):
        raise OptionError("give READINGS, or --pose for each pose")
    opt.check_writable(rows, robot=save)
    with opt.progress_bar("extract"):
        shown: Any = pose or [] if readings is None else readings
        if readings is not None and (files.joints or files.sheet or files.layout):
            shown = files.read(readings, wb.load_robot(robot))
        found = wb.extract(robot, shown, columns=files.columns, reading=reading)
    if rows is not None:
        opt.say(f"readings in SI: {wb.write_measurements(found.run.data, rows)}")
    doubt = "" if found.verdict in ("nominal", "extracted") else found.sentence
    opt.give(found, doubt, save, saved="the controller's model")


TouchesArgument = Annotated[
    Path, argument("Joints at each touch, one line each (q1[deg] …); `contact` names what was touched.")
]
WantedOption = Annotated[str | None, option("--wanted", "Required accuracy, such as 0.2mm.")]


@in_section("Calibrate")
def tcp(
    touches: TouchesArgument,
    robot: opt.RobotOption,
    wanted: WantedOption = None,
    save: Annotated[Path | None, option("Write the robot with this tool here (.toml or .urdf).")] = None,
    columns: opt.ColumnsOption = None,
) -> None:
    """Tool tip from touching one point in four orientations or more."""
    opt.check_writable(robot=save)
    found = wb.tcp(robot, touches, wanted=wanted, columns=columns)
    opt.give(found, found.doubt, save, saved="robot with the tool")


@in_section("Calibrate")
def frame(
    touches: TouchesArgument,
    robot: opt.RobotOption,
    cad: Annotated[Path | None, option("Points of the drawing, as `contact` names: point, x[mm] …")] = None,
    wanted: WantedOption = None,
    save: Annotated[Path | None, option("Write the frame here (.toml).")] = None,
    columns: opt.ColumnsOption = None,
) -> None:
    """User frame from three points, 3-2-1 on a part's faces, or the points of a fixture's drawing."""
    if save is not None and save.suffix.lower() != ".toml":
        raise OptionError(f"{save}: a frame is saved as .toml")
    opt.check_writable(save)
    found = wb.frame(robot, touches, cad=cad, wanted=wanted, columns=columns)
    opt.give(found, found.doubt, save, saved="frame")


@in_section("Calibrate")
def new(
    source: Annotated[str, argument("A DH table (CSV, xlsx, JSON, YAML), a .urdf, or a known arm.")],
    out: Annotated[Path, option("Write the robot here (.toml).")],
    pose: Annotated[
        list[str] | None,
        option(
            "A pose as shown on the pendant, flange in the robot's base: "
            '"q1,…,qn = x,y,z,a,b,c" (angles, or a quaternion); give three or more. Units are detected.'
        ),
    ] = None,
    poses: Annotated[
        Path | None, option("The same as a table; or six or more measured rows of any tool in any frame.")
    ] = None,
    name: Annotated[str | None, option("Name of the robot.")] = None,
    apply: Annotated[Path | None, option("With --for: a file of the arm's controller or driver.")] = None,
    form: Annotated[str | None, option("--for", "With --apply: its form, such as ur-calibration.")] = None,
    tip: opt.TipOption = None,
    columns: opt.ColumnsOption = None,
    force: Annotated[bool, option("Write the robot although another reading fits as well.")] = False,
) -> None:
    """Your own robot: signs, offsets, units, convention told by three pendant poses or measured rows."""
    from dataclasses import replace

    from workbench.arm.built_in_arms import save_robot
    from workbench.exports import applied
    from workbench.extras.pendant.own_robot.find_convention import find_convention, read_poses, readings_of

    if (apply is None) != (form is None):
        raise OptionError("--apply FILE and --for NAME, such as ur-kinematics, belong together")
    opt.check_writable(robot=out)
    content, doubt = dict[str, Any](schema="workbench.robot/1", file=str(out)), ""
    if apply is not None and form is not None:
        arm = applied(wb.load_robot(source, tip=tip), apply, form)
    else:
        readings = readings_of(source, tip=tip)
        shown = read_poses(poses or pose or [], readings[0].robot, columns=columns)
        found = find_convention(readings, shown)
        arm, reading, doubt = found.robot, found.reading, found.doubt
        for text in found.notes:
            opt.say(text)
        content |= {"words": list(found.assumptions), "changes": list(found.changes), "tried": found.tried}
        content |= {"position_m": reading.position, "rotation_rad": reading.rotation}
    arm = replace(arm, name=name or arm.name)
    opt.write_result(content)
    if force or not doubt:
        opt.say(f"{arm.name}: {save_robot(arm, out)}")
    if doubt:
        opt.fail(f"{doubt}; {out} is {'written because of' if force else 'not written without'} --force")
