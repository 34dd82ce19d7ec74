"""Checking an arm, or its table, against poses typed from its pendant.

A table is CSV: Denavit–Hartenberg constants of a joint in each row, with units in the headings or without.
"""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.conventions import CONSTANTS, ORDERS
from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base.errors import FileError
from workbench.base.files import read_bytes
from workbench.base.types import Freedom
from workbench.data.dataset import Dataset
from workbench.extras.pendant.displayed import typed
from workbench.extras.pendant.own_robot.find_convention import FoundConvention, find_convention
from workbench.extras.pendant.own_robot.table_meanings import TableReading, table_readings

NAMES = {"θ": "theta", "offset": "theta", "α": "alpha", "twist": "alpha", "r": "a", "β": "beta"}
"""Other headings of the constants."""
KINDS = {
    "revolute": "revolute",
    "r": "revolute",
    "prismatic": "prismatic",
    "p": "prismatic",
    "fixed": "fixed",
}
LENGTHS, ANGLES = ("m", "mm"), ("rad", "deg")
HEADING = re.compile(r"\s*([^\[\(]+?)\s*(?:[\[\(]\s*([^\]\)]*?)\s*[\]\)])?\s*")
DRIVE = re.compile(r"^(?:q|theta|θ)_?\d*(?=[+-]|$)")
"""The joint itself before its offset, as in `q2-90`."""
SHARE = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)?(?:e[+-]?\d+)?)\*?(pi)?(?:/([1-9]\d*))?")
MAX_FILE_BYTES = 2**20
UNKNOWN = Frame(free=Freedom.AUTO)


@dataclass(frozen=True)
class JointTable:
    """A table as it stands in its file.

    Args:
        rows: `type` and constants of every joint, in the file's units.
        conventions: That it may be of: its own where the file says it.
        lengths: Units of d and a that may be meant.
        angles: The same for the angles.
    """

    rows: tuple[dict[str, Any], ...]
    conventions: tuple[str, ...]
    lengths: tuple[str, ...]
    angles: tuple[str, ...]


def read_joint_table(path: Path | str) -> JointTable:
    """Columns theta, d, a, alpha (beta, type) in any order; a line `# convention = dh` may tell which."""
    text = read_bytes(path, wanted="a joint table (.csv)", maximum=MAX_FILE_BYTES).decode(
        "utf-8-sig", errors="replace"
    )
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    stated = [m[1] for _, line in lines if (m := re.match(r"#.*convention\s*=\s*([\w-]+)", line))]
    lines = [(n, line) for n, line in lines if not line.startswith("#")]
    if stated and stated[0] not in ORDERS:
        raise FileError(f"convention is '{stated[0]}'; known: {', '.join(ORDERS)}", path=str(path))
    if len(lines) < 2:
        raise FileError("has no joints; give a line of headings and one for each joint", path=str(path))
    separator = max(",;\t", key=lines[0][1].count)
    heads = [_heading(cell) for cell in next(csv.reader([lines[0][1]], delimiter=separator))]
    missing = [c for c in CONSTANTS[:4] if c not in [name for name, _ in heads]]
    if missing:
        raise FileError(
            f"has no column {', '.join(missing)}; give theta, d, a, alpha", path=str(path), line=lines[0][0]
        )
    rows = []
    for number, line in lines[1:]:
        cells = next(csv.reader([line], delimiter=separator))
        rows.append(_row(dict(zip((name for name, _ in heads), cells, strict=False)), path, number))
    units = {name: unit for name, unit in heads if unit}
    return JointTable(
        tuple(rows),
        tuple(stated) or ("dh", "craig"),
        _units(units, ("d", "a"), LENGTHS, path),
        _units(units, ("theta", "alpha", "beta"), ANGLES, path),
    )


def _heading(cell: str) -> tuple[str, str]:
    found = HEADING.fullmatch(cell)
    name, unit = (found[1].lower(), found[2] or "") if found else (cell, "")
    return NAMES.get(name, name), unit.lower().replace("°", "deg")


def _row(cells: dict[str, str], path: Path | str, line: int) -> dict[str, Any]:
    kind = KINDS.get(cells.get("type", "revolute").strip().lower())
    if kind is None:
        raise FileError(f"type is '{cells['type']}'; known: {', '.join(KINDS)}", path=str(path), line=line)
    row: dict[str, Any] = {"type": kind}
    for name in CONSTANTS:
        text = cells.get(name, "0").strip() or "0"
        value = _number(text)
        if value is None:
            raise FileError(f"'{text}' is not a number", path=str(path), line=line, column=name)
        row[name] = value
    return row


def _number(text: str) -> float | None:
    """A number, a share of pi such as `-pi/2`, or the constant of `q2-90`; None if it is none of these."""
    text = text.lower().replace(" ", "").replace("−", "-").replace("π", "pi")
    constant = DRIVE.sub("", text)
    if constant != text and not constant:
        return 0.0
    found = SHARE.fullmatch(constant)
    if found is None or not (found[2] or any(c.isdigit() for c in found[1])):
        return None
    size = float(found[1]) if found[1] not in ("", "+", "-") else float(f"{found[1]}1")
    return size * (np.pi if found[2] else 1.0) / float(found[3] or 1.0)


def _units(given: dict[str, str], names: tuple[str, ...], known: tuple[str, str], path) -> tuple[str, ...]:
    found = {given[name] for name in names if name in given}
    if wrong := found - set(known):
        raise FileError(f"has the unit '{sorted(wrong)[0]}'; give {' or '.join(known)}", path=str(path))
    if len(found) > 1:
        raise FileError(f"mixes {' and '.join(sorted(found))}; give one unit", path=str(path))
    return tuple(found) or known


TABLES = (".csv",)
"""Files that hold a joint table."""


def check_robot(
    source: Path | str, poses: Sequence[str] | Dataset, *, tip: str | None = None, name: str = ""
) -> FoundConvention:
    """The reading of an arm or its table that gives the poses of the pendant.

    Its base and tool are decided from the data: the pendant's are not those of a later measurement.

    Args:
        source: A joint table (.csv), a file of a robot, or a built-in arm by name.
        poses: `q1,…,qn = x,y,z,a,b,c` (or a quaternion) each, whose units are found; or rows.
        tip: Last link of the chain, for a URDF with several.
        name: Of the arm in what is found; its own, or that of the table's file, if empty.
    """
    readings = readings_of(source, tip=tip, name=name)
    shown = poses if isinstance(poses, Dataset) else typed(poses, readings[0].robot.dof)
    found = find_convention(readings, shown)
    return replace(found, robot=found.robot.with_frames(base=UNKNOWN, tool=UNKNOWN))


def readings_of(source: Path | str, *, tip: str | None = None, name: str = "") -> list[TableReading]:
    """What a file or a built-in arm may mean: a table in several ways, everything else in one."""
    path = Path(source)
    if path.suffix.lower() not in TABLES:
        robot = load_robot(source, tip=tip)
        return [TableReading(robot.bare)]
    table = read_joint_table(path)
    return table_readings(
        table.rows,
        conventions=table.conventions,
        lengths=table.lengths,
        angles=table.angles,
        name=name or path.stem,
    )


def convention_notes(found: FoundConvention) -> tuple[str, ...]:
    """What fits, what differs from the arm as it was given, and how well, one sentence each."""
    return (
        f"it fits: {', '.join(found.assumptions) or 'as it was given'}",
        *(f"change: {change}" for change in found.reading.changes),
        f"errors at the typed poses: {found.reading.size}; {found.tried} readings tried",
    )


def robot_that_gives(source: Path | str, poses: Sequence[str]) -> Robot:
    """The arm that gives typed poses, with what was found in its notes."""
    found = check_robot(source, poses)
    return replace(found.robot, notes=(*found.robot.notes, *convention_notes(found)))
