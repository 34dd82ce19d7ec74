"""Possible meanings of a joint table: conventions and units."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.arm.robot_toml import robot_from_rows
from workbench.base.arguments import checked_arguments
from workbench.base.errors import FileError, OptionError
from workbench.extras.pendant.displayed import SIZES


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


def possible(units: Sequence[str], values: Sequence[float]) -> Sequence[str]:
    """Those of two units in which some numbers make sense; both where either does."""
    largest = float(np.abs(values).max()) if np.size(values) else 0.0
    bounds = {"m": (0.0, 20.0), "mm": (5.0, np.inf), "rad": (0.0, 2.1 * np.pi), "deg": (0.0, np.inf)}
    kept = [u for u in units if bounds[u][0] <= largest <= bounds[u][1]]
    return kept or units
