"""Joint tables as CSV: Denavit–Hartenberg constants a row, with units in the headings or without."""

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.arm.conventions import CONSTANTS, ORDERS
from workbench.base.errors import FileError
from workbench.base.files import read_bytes

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
LARGEST = 2**20


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
    """Read columns theta, d, a, alpha (beta, type) in any order; a line `# convention = dh` may tell which.

    Raises:
        FileError: no such table; names line and column.
    """
    text = read_bytes(path, wanted="a joint table (.csv)", most=LARGEST).decode("utf-8-sig", errors="replace")
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
    said = [m[1] for _, line in lines if (m := re.match(r"#.*convention\s*=\s*([\w-]+)", line))]
    lines = [(n, line) for n, line in lines if not line.startswith("#")]
    if said and said[0] not in ORDERS:
        raise FileError(f"convention is '{said[0]}'; known are {', '.join(ORDERS)}", path=str(path))
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
        tuple(said) or ("dh", "craig"),
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
        raise FileError(f"type is '{cells['type']}'; known are {', '.join(KINDS)}", path=str(path), line=line)
    row: dict[str, Any] = {"type": kind}
    for name in CONSTANTS:
        text = cells.get(name, "0").strip() or "0"
        try:
            row[name] = float(text)
        except ValueError:
            raise FileError(f"'{text}' is no number", path=str(path), line=line, column=name) from None
    return row


def _units(given: dict[str, str], names: tuple[str, ...], known: tuple[str, str], path) -> tuple[str, ...]:
    found = {given[name] for name in names if name in given}
    if wrong := found - set(known):
        raise FileError(f"has the unit '{sorted(wrong)[0]}'; give {' or '.join(known)}", path=str(path))
    if len(found) > 1:
        raise FileError(f"mixes {' and '.join(sorted(found))}; give one unit", path=str(path))
    return tuple(found) or known
