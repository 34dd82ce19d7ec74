"""Possible meanings of a joint table, and of poses typed with it: conventions and units."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import robot_from_rows
from workbench.base.arguments import checked_arguments
from workbench.base.errors import FileError, OptionError, ShapeError
from workbench.base.types import frozen
from workbench.data.orientations import USUAL_ORIENTATIONS
from workbench.extras.pendant.own_robot.displayed_poses import SIZES, meanings, possible


@dataclass(frozen=True, eq=False)
class Typed:
    """Joint positions and poses under one understanding of their units.

    Args:
        q: Joint positions [rad or m].
        poses: Of the flange in the robot's base.
        assumptions: What was assumed of the numbers, such as `joints in deg`.
    """

    q: Float[np.ndarray, "m n"]
    poses: Float[np.ndarray, "m 4 4"]
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class TableReading:
    """One way to read a table.

    Args:
        robot: The arm under it, with neither base nor tool.
        assumptions: What was assumed, such as `standard DH` or `lengths in mm`.
    """

    robot: Robot
    assumptions: tuple[str, ...] = ()


def _numbers(row: dict, number: int) -> dict:
    """A row of a joint table, all but the joint's type as numbers."""
    try:
        return {key: value if key == "type" else float(value) for key, value in row.items()}
    except (TypeError, ValueError):
        raise OptionError(f"row {number} must hold numbers, got {row}", option="rows", found=row) from None


@checked_arguments()
def table_readings(
    rows: Sequence[dict],
    *,
    conventions: Sequence[str] = ("dh", "craig"),
    lengths: Sequence[str] = ("m", "mm"),
    angles: Sequence[str] = ("rad", "deg"),
    name: str = "robot",
    limits=None,
) -> list[TableReading]:
    """What a joint table may mean.

    Args:
        rows: `theta`, `d`, `a`, `alpha` (`beta`, `type`) of every joint, as numbers stand there.
        conventions: That may be meant.
        lengths: Units that may be meant, the likeliest first.
        angles: The same for angles.
        name: Of the robot.
        limits: Of its joints [rad or m], if known.
    """
    if unknown := [unit for unit in (*lengths, *angles) if unit not in SIZES]:
        raise OptionError(f"unknown unit '{unknown[0]}'; choose from {', '.join(SIZES)}")
    titles = {"dh": "standard DH", "craig": "modified DH (Craig)"}
    rows = [_numbers(row, number) for number, row in enumerate(rows, start=1)]
    lengths = possible(lengths, [row.get(key, 0.0) for row in rows for key in ("d", "a")])
    angles = possible(angles, [row.get(key, 0.0) for row in rows for key in ("theta", "alpha", "beta")])
    out: list[TableReading] = []
    refused: FileError | None = None
    for convention, length, angle in product(conventions, lengths, angles):
        scaled = [
            {
                key: value if key == "type" else value * SIZES[length if key in ("d", "a") else angle]
                for key, value in row.items()
            }
            for row in rows
        ]
        try:
            robot = robot_from_rows(scaled, convention, name=name, limits=limits)
        except FileError as error:  # units that no arm has
            refused = error
            continue
        assumed = (titles.get(convention, convention), f"lengths in {length}", f"angles in {angle}")
        out.append(TableReading(robot.with_frames(base=Frame(), tool=Frame()), assumed))
    if refused is not None and not out:
        raise refused
    return out


@checked_arguments()
def typed_readings(numbers: Float[np.ndarray, "m k"], slides: Sequence[bool]) -> list[Typed]:
    """What numbers typed from a pendant may mean: joints, then x, y, z, and three angles or a quaternion.

    Args:
        numbers: A row for each pose.
        slides: Which joints slide.
    """
    if numbers.shape[1] < (needed := len(slides) + 6):
        raise ShapeError(
            f"each pose needs {needed} numbers (joints, x, y, z and three angles), got {numbers.shape[1]}",
            expected=needed,
            found=numbers.shape[1],
        )
    joints, xyz, turn = np.split(numbers, [len(slides), len(slides) + 3], axis=1)
    found = meanings(joints, xyz, turn, slides, kinds=USUAL_ORIENTATIONS)
    return [Typed(frozen(m.q), frozen(m.poses), m.assumptions) for m in found]
