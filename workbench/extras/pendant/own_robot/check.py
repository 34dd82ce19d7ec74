"""Checking an arm, or its table, against poses typed from its pendant.

A table is CSV: Denavit–Hartenberg constants of a joint in each row, with units in the headings or without.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.conventions import CONSTANTS, ORDERS
from workbench.arm.frame import Frame
from workbench.arm.robot import Robot
from workbench.base.files import read_bytes
from workbench.base.types import Freedom
from workbench.base.units import parse_heading
from workbench.data.dataset import Dataset
from workbench.data.readers.table import Grid
from workbench.data.readers.text import read_text
from workbench.extras.pendant.displayed import Displayed, typed
from workbench.extras.pendant.own_robot.find_convention import FoundConvention, find_convention
from workbench.extras.pendant.own_robot.table_meanings import TableReading, table_readings

NAMES = {"θ": "theta", "offset": "theta", "α": "alpha", "twist": "alpha", "r": "a", "β": "beta"}
"""Other headings of the constants."""
KINDS = {"r": "revolute", "p": "prismatic"} | {k: k for k in ("revolute", "prismatic", "fixed")}
LENGTHS, ANGLES = ("m", "mm"), ("rad", "deg")
UNITS = {"°": "deg", "degree": "deg", "degrees": "deg"}
INDEX = re.compile(r"_?\{?_?i(?:[-−]1)?\}?$")
"""Of a constant in a paper, as in `alpha_{i-1}`."""
DRIVE = re.compile(r"^(?:q|theta|θ)_?\{?\d*\}?\*?(?=[+-]|$)")
"""The joint itself before its offset, as in `q2-90`."""
SHARE = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)?(?:e[+-]?\d+)?)\*?(pi)?(?:/([1-9]\d*))?")
MAX_FILE_BYTES = 2**20
UNKNOWN = Frame(free=Freedom.AUTO)


class JointTable(NamedTuple):
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
    path = Path(path)
    grid = read_text(read_bytes(path, wanted="a joint table (.csv)", maximum=MAX_FILE_BYTES), path)
    stated = tuple(m[1] for text in grid.comments if (m := re.match(r"\s*convention\s*=\s*([\w-]+)", text)))
    if stated and stated[0] not in ORDERS:
        raise grid.error(f"convention is '{stated[0]}'; known: {', '.join(ORDERS)}")
    if len(grid.rows) < 2:
        raise grid.error("has no joints; give a line of headings and one for each joint")
    heads = [parse_heading(cell) for cell in grid.rows[0]]
    names = [INDEX.sub("", head.name.lower().removesuffix("_offset")) for head in heads]
    names = [NAMES.get(name, name) for name in names]
    if missing := [name for name in CONSTANTS[:4] if name not in names]:
        raise grid.error(f"has no column {', '.join(missing)}; give theta, d, a, alpha", 0)
    filled = [(k, cells) for k, cells in enumerate(grid.rows[1:], 1) if any(cells)]
    rows = [_row(dict(zip(names, cells, strict=False)), grid, k) for k, cells in filled]
    stands = {name: (head.unit or "").lower() for name, head in zip(names, heads, strict=True)}
    units = {name: UNITS.get(unit, unit) for name, unit in stands.items() if unit}
    lengths = _units(units, ("d", "a"), LENGTHS, grid)
    units |= {"°": "deg"} if any("°" in c for cells in grid.rows[1:] for c in cells) else {}
    angles = _units(units, ("theta", "alpha", "beta", "°"), ANGLES, grid)
    return JointTable(tuple(rows), stated[:1] or ("dh", "craig"), lengths, angles)


def _row(cells: dict[str, str], grid: Grid, number: int) -> dict[str, Any]:
    kind = KINDS.get(cells.get("type", "revolute").strip().lower())
    if kind is None:
        raise grid.error(f"type is '{cells['type']}'; known: {', '.join(KINDS)}", number)
    row: dict[str, Any] = {"type": kind}
    for name in CONSTANTS:
        text = cells.get(name, "0").strip() or "0"
        row[name] = _number(text)
        if row[name] is None:
            raise grid.error(f"{name} is '{text}', which is not a number", number)
    return row


def _number(text: str) -> float | None:
    """A number, a share of pi such as `-pi/2`, or the constant of `q2-90`; None if it is none of these."""
    text = re.sub("[ °]", "", text.lower()).replace("−", "-").replace("π", "pi")
    constant = DRIVE.sub("", text)
    if constant != text and not constant:
        return 0.0
    found = SHARE.fullmatch(constant)
    if found is None or not (found[2] or any(c.isdigit() for c in found[1])):
        return None
    size = float(found[1]) if found[1] not in ("", "+", "-") else float(f"{found[1]}1")
    return size * (np.pi if found[2] else 1.0) / float(found[3] or 1.0)


def _units(
    given: dict[str, str], names: tuple[str, ...], known: tuple[str, str], grid: Grid
) -> tuple[str, ...]:
    found = {given[name] for name in names if name in given}
    if wrong := found - set(known):
        raise grid.error(f"has the unit '{sorted(wrong)[0]}'; give {' or '.join(known)}")
    if len(found) > 1:
        raise grid.error(f"mixes {' and '.join(sorted(found))}; give one unit")
    return tuple(found) or known


def check_robot(
    source: Path | str, poses: Sequence[str] | Displayed | Dataset, *, tip: str | None = None, name: str = ""
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
    shown = poses if isinstance(poses, Displayed | Dataset) else typed(poses, readings[0].robot.dof)
    found = find_convention(readings, shown)
    return replace(found, robot=found.robot.with_frames(base=UNKNOWN, tool=UNKNOWN))


def readings_of(source: Path | str, *, tip: str | None = None, name: str = "") -> list[TableReading]:
    """What a file or a built-in arm may mean: a table in several ways, everything else in one."""
    path = Path(source)
    if path.suffix.lower() != ".csv":
        return [TableReading(load_robot(source, tip=tip).bare)]
    return table_readings(**read_joint_table(path)._asdict(), name=name or path.stem)


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
