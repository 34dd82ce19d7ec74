"""An arm, or a table of one, checked against poses that were typed from its pendant."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.arm.built_in_arms import load_robot
from workbench.arm.own_robot.find_convention import Found, find_convention
from workbench.arm.own_robot.joint_table import read_joint_table
from workbench.arm.own_robot.readings import Reading, Typed, table_readings, typed_readings
from workbench.arm.robot import Frame, Robot
from workbench.base.errors import OptionError

TABLES = (".csv",)
"""Files that hold a joint table."""


def check_robot(
    source: Path | str, poses: Sequence[str] | Typed, *, tip: str | None = None, name: str = ""
) -> Found:
    """The reading of an arm or its table that gives the poses of the pendant.

    Args:
        source: A joint table (.csv), a file of a robot, or a built-in arm by name.
        poses: `q1,…,qn = x,y,z,roll,pitch,yaw` each, whose units are found; or poses whose units are known.
        tip: Last link of the chain, for a URDF with several.
        name: Of the arm in what is found; its own, or that of the table's file, if empty.

    Raises:
        FileError: no robot and no table.
        OptionError: poses in other words.
        ShapeError: fewer than three poses, or another number of joints.
        DataError: no reading fits, or several do and differ elsewhere.
    """
    readings = readings_of(source, tip=tip, name=name)
    robot = readings[0].robot
    if isinstance(poses, Typed):
        return find_convention(readings, [poses])
    slides = [not e.axis.turns for e in robot.elements if e.joint is not None]
    return find_convention(readings, typed_readings(_numbers(poses, robot), slides))


def readings_of(source: Path | str, *, tip: str | None = None, name: str = "") -> list[Reading]:
    """What a file or a built-in arm may mean: a table in several ways, everything else in one."""
    path = Path(source)
    if path.suffix.lower() not in TABLES:
        robot = load_robot(source, tip=tip)
        return [Reading(robot.with_effects().with_frames(base=Frame(), tool=Frame()))]
    table = read_joint_table(path)
    return table_readings(
        table.rows,
        conventions=table.conventions,
        lengths=table.lengths,
        angles=table.angles,
        name=name or path.stem,
    )


def found_words(found: Found) -> tuple[str, ...]:
    """What fits, what differs from the arm as it was given, and how well, one sentence each."""
    return (
        f"it fits: {', '.join(found.words) or 'as it was given'}",
        *(f"change: {change}" for change in found.changes),
        f"errors at the typed poses: at most {1e3 * found.position:.3f} mm and "
        f"{np.rad2deg(found.rotation):.3f}°; {found.tried} readings tried",
    )


def _numbers(texts: Sequence[str], robot: Robot) -> Float[np.ndarray, "m n6"]:
    """Poses typed in words as rows of numbers."""
    rows = []
    for text in texts:
        left, _, right = text.partition("=")
        try:
            q, pose = ([float(v) for v in re.split(r"[,;\s]+", part.strip())] for part in (left, right))
        except ValueError:
            q, pose = [], []
        if len(q) != robot.dof or len(pose) != 6:
            raise OptionError(
                f"the pose '{text}' must be {robot.dof} joint positions, =, x, y, z and three angles, with "
                "commas"
            )
        rows.append(q + pose)
    return np.array(rows).reshape(len(rows), -1)
