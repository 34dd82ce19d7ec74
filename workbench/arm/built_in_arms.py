"""The built-in arms, and a single loader for a built-in name or a file: TOML or URDF.

And a substitute where only tool poses are known: three prismatic and three revolute joints.
"""

from functools import cache
from pathlib import Path

from workbench.arm.chain import Axis, Element
from workbench.arm.robot import Joint, JointKind, Robot
from workbench.arm.robot_toml import read_toml, write_toml
from workbench.base.assets import built_in_robots
from workbench.base.errors import FileError, OptionError, RobotError

ORDER = (Axis.TX, Axis.TY, Axis.TZ, Axis.RZ, Axis.RY, Axis.RX)
"""Joints of the substitute: x y z [m], yaw pitch roll [rad]."""


@cache
def posed_arm() -> Robot:
    """A substitute arm whose joints are x y z yaw pitch roll of the tool in the robot's base, none of it
    free."""
    elements = [Element(axis, f"pose.{axis.name.lower()}", joint=k, link=k) for k, axis in enumerate(ORDER)]
    kinds = [JointKind.REVOLUTE if axis.turns else JointKind.PRISMATIC for axis in ORDER]
    return Robot(
        name="tool poses",
        convention="elementary",
        elements=tuple(elements),
        joints=tuple(Joint(name=f"joint{k + 1}", kind=kind) for k, kind in enumerate(kinds)),
        link_ends=tuple(range(len(ORDER))),
    )


def load_robot(source: Path | str, *, tip: str | None = None) -> Robot:
    """A robot from a TOML or URDF file, or a built-in arm by name (`aria`, `katana450`, …).

    Raises:
        FileError: neither a file nor a built-in name, or a file that is no robot.
    """
    path, name, built_in = Path(source), str(source).lower(), built_in_robots()
    refuse_xacro(path)
    if path.suffix.lower() in (".urdf", ".xml"):
        from workbench.arm.urdf import read_urdf

        return read_urdf(path, tip=tip)
    if tip is not None:
        raise OptionError(f"tip names a link of a URDF; {source} is none", option="tip", found=tip)
    if name in built_in:
        return _built_in(built_in[name])
    if path.suffix.lower() != ".toml":
        raise FileError(
            f"is no .toml, .urdf or built-in arm ('workbench new': tables); built-in: {', '.join(built_in)}",
            path=str(source),
        )
    return read_toml(path)


def refuse_xacro(path: Path) -> None:
    """Raise for a xacro: it is a program, which only its owner should run."""
    if path.suffix.lower() == ".xacro":
        urdf = path.with_suffix("").name
        raise FileError(f"is a xacro; expand it first: 'xacro {path.name} > {urdf}' (ROS)", path=str(path))


@cache
def _built_in(path: Path) -> Robot:
    """The single object of a built-in arm, so that caches by arm are shared."""
    return read_toml(path)


def save_robot(robot: Robot, path: Path | str, *, force: bool = False) -> Path:
    """Write a robot in the format of the file's extension: `.toml`, or `.urdf` for what it can represent.

    Raises:
        RobotError: its calibration says that such a file should not be used, and `force` is not given.
    """
    path = check_robot_file(path)
    if not force and (reason := refusal(robot, path.suffix)):
        raise RobotError(f"{path.name} is not written: {reason}")
    if path.suffix.lower() == ".toml":
        return write_toml(robot, path)
    from workbench.arm.urdf_writer import write_urdf

    return write_urdf(robot, path)


def refusal(robot: Robot, ending: str) -> str:
    """Why a file of a calibrated arm should not be used, by its ending; empty if it may."""
    refused = {} if robot.calibration is None else robot.calibration.refused
    return "; ".join(refused[name] for name in ("", ending[1:].upper()) if name in refused)


def check_robot_file(path: Path | str) -> Path:
    """The path, checked for a robot file's extension."""
    path = Path(path)
    if path.suffix.lower() not in (".toml", ".urdf"):
        raise OptionError(f"{path}: a robot is saved as .toml or .urdf, got '{path.suffix}'")
    return path
