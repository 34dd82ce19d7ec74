"""Units of a robot's numbers: millimetres, inches and degrees are refused where metres and radians are meant.

No tool is 60 m from its arm's base, and no link is rotated by two turns. A larger whole number, such as 90,
is in degrees, also for a joint whose encoder counts turns. Single lengths may be large: the common normal of
two nearly parallel axes is far away, and the next row compensates it. So the position of the tool is checked,
not the table.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from workbench.arm.robot import UNUSUAL_REACH, JointKind, Robot
from workbench.base.errors import RobotError
from workbench.base.toml import AbstractTableReader
from workbench.base.types import Vector3

MAX_DISTANCE = 60.0
"""Distance of the tool from the base that is impossible [m]."""
USUAL_REACH = 1.0
"""Reach of a typical arm [m], which decides between units."""
UNITS = {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254}
TURN = 2.0 * np.pi
ROUNDING = 1e-9


def with_plausible_units(robot: Robot) -> Robot:
    """The robot, with a note if it is unusually large."""
    for e in robot.elements:
        still = e.joint is None and abs(e.value) > 2.0 * TURN
        if e.matrix is None and e.axis.turns and (still or is_whole_degrees(e.value)):
            raise RobotError(
                f"{e.name} is {e.value:g} rad, {abs(e.value) / TURN:.1f} turns, which looks like degrees; "
                f"give radians, {np.deg2rad(e.value):.6g}"
            )
    if (far := robot.reach) <= UNUSUAL_REACH:
        return robot
    unit, size = min(UNITS.items(), key=lambda u: abs(np.log(far * u[1] / USUAL_REACH)))
    text = f"its tool is up to {far:.4g} m from its base, which in {unit} would be {far * size:.3g} m"
    if far <= MAX_DISTANCE:
        return replace(robot, notes=(*robot.notes, f"{text}: check that its lengths are in m"))
    name, value = max(_lengths(robot), key=lambda length: abs(length[1]))
    if far * size > MAX_DISTANCE:
        raise RobotError(f"{text}; {name} is {value:g}, which no unit explains: give its actual value in m")
    raise RobotError(f"{text}; give lengths in m, such as {name} = {value * size:.6g} instead of {value:g}")


def is_whole_degrees(value: float) -> bool:
    """Whether a number makes no sense as an angle in radians, but does in degrees."""
    return bool(2.0 * TURN < abs(value) < np.inf and abs(value - round(value)) < ROUNDING)


def rpy_of(reader: AbstractTableReader, value: Any, what: str) -> Vector3:
    """Roll, pitch and yaw in a file."""
    rpy = reader.numbers(value, 3, what)
    if any(map(is_whole_degrees, rpy)):
        radians = np.deg2rad(rpy).round(6).tolist()
        raise reader.fail(f"{what} {rpy.tolist()} looks like degrees; give radians, {radians}")
    return rpy


def _lengths(robot: Robot) -> list[tuple[str, float]]:
    """Names and values of all lengths [m]."""
    found = [(e.name, e.value) for e in robot.elements if e.matrix is None and not e.axis.turns]
    found += [(f"the length of {e.name}", float(np.linalg.norm(e.matrix[:3, 3]))) for e in robot.elements
              if e.matrix is not None]  # fmt: skip
    found += [(f"tool.{axis}", float(v)) for axis, v in zip("xyz", robot.tool.xyz, strict=True)]
    slides = [j for j in robot.moving if j.kind is JointKind.PRISMATIC and np.isfinite(j.limits).all()]
    return found + [(f"the limit of {j.name}", max(j.limits, key=abs)) for j in slides]
