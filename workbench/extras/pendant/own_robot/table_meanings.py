"""Joint tables: what stands in their files, and what it may mean, in conventions and units.

Denavit–Hartenberg constants of a joint stand in each row, with units in the headings or without, or behind
their names, joint by joint, as in JSON and YAML.
"""

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.arm.conventions import CONSTANTS
from workbench.arm.frame import Frame
from workbench.arm.robot import JointKind, Robot
from workbench.arm.robot_toml import robot_from_rows
from workbench.base.arguments import checked_arguments
from workbench.base.errors import FileError, OptionError
from workbench.base.units import parse_heading
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.read import read_grid
from workbench.data.readers.table import Grid, grid_of
from workbench.data.readers.text import decode
from workbench.extras.pendant.displayed import SIZES

NAMES = {"θ": "theta", "offset": "theta", "α": "alpha", "twist": "alpha", "r": "a", "β": "beta"}
NAMES |= {"sigma": "type"}
"""Other headings of the constants."""
KINDS = {"r": "revolute", "p": "prismatic", "continuous": "revolute"} | {str(k): str(k) for k in JointKind}
KINDS |= {"0": "revolute", "1": "prismatic"}
KEYED = re.compile(r"([^\W\d]\w*)(?:[\"']?\s*:|[\"']\s*,)[^\S\n]*(\[[^\]{}]*\]|[^\s,\[\]{}()][^\n,{}()]*)")
"""A key and what stands behind it in JSON, YAML and MATLAB's `Link('d', 0.4)`."""
LENGTHS, ANGLES = ("m", "mm"), ("rad", "deg")
UNITS = {"°": "deg", "degree": "deg", "degrees": "deg"}
ENDING, WORD = re.compile(r"[_ ](deg|rad|mm|m)$", re.I), re.compile(r"[a-zα-ω]*$")
"""A unit behind a name, as in `theta_deg`, and a heading's last word."""
INDEX = re.compile(r"_?\{?_?i(?:[-−]1)?\}?$")
"""Of a constant in a paper, as in `alpha_{i-1}`."""
DRIVE = re.compile(r"^(?:q|theta|θ)_?\{?\d*\}?\*?(?=[+-]|$)")
"""The joint itself before its offset, as in `q2-90`."""
SHARE = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)?(?:e[+-]?\d+)?)\*?(pi)?(?:/([1-9]\d*))?")
WANTED = "write a table (.csv) with the headings theta, d, a, alpha and a line for each joint"


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
    grid = _grid(Path(path))
    stated = tuple(m[1] for text in grid.comments if (m := re.match(r"\s*convention\s*=\s*([\w-]+)", text)))
    if len(grid.rows) < 2:
        raise grid.error(f"names no constants of joints; {WANTED}")
    first = [cells[0] for cells in grid.rows]
    if {*CONSTANTS[:4]} <= {*_constants(first)}:  # a line for each constant
        grid = grid_of(first, [cells[1:] for cells in grid.rows], source=grid.source)
    names = _constants(grid.rows[0])
    stands = [(parse_heading(ENDING.sub(r"[\1]", cell)).unit or "").lower() for cell in grid.rows[0]]
    if missing := [name for name in CONSTANTS[:4] if name not in names]:
        raise grid.error(f"has no column {', '.join(missing)}; {WANTED}", 0)
    filled = [(k, cells) for k, cells in enumerate(grid.rows[1:], 1) if any(cells)]
    rows = [_row([*zip(names, cells, strict=False)], grid, k) for k, cells in filled]
    units = {name: UNITS.get(unit, unit) for name, unit in zip(names, stands, strict=True) if unit}
    lengths = _units(units, ("d", "a"), LENGTHS, grid)
    units |= {"°": "deg"} if any("°" in c for cells in grid.rows[1:] for c in cells) else {}
    angles = _units(units, ("theta", "alpha", "beta", "°"), ANGLES, grid)
    return JointTable(tuple(rows), stated[:1] or ("dh", "craig"), lengths, angles)


def _grid(path: Path) -> Grid:
    if path.suffix.lower() not in (".json", ".yaml", ".yml", ".m"):
        return read_grid(path)
    found: dict[str, list[str]] = defaultdict(list)
    for key, value in KEYED.findall(re.sub(r"(?m)(^|\s)#.*", "", decode(read_bytes(path), path)[0])):
        found[key] += re.findall(r"[^\s,\"'\[\]]+", value)
    names = dict(zip(found, _constants(list(found)), strict=True))
    found = {key: own for key, own in found.items() if names[key] in (*CONSTANTS, "type")}
    if len({*map(len, found.values())}) > 1:
        for key in [key for key in found if names[key] == "type" and KINDS.keys().isdisjoint(found[key])]:
            del found[key]  # of something else
    if len({*map(len, found.values())}) > 1:
        counts = ", ".join(f"{len(cells)} of {key}" for key, cells in found.items())
        raise FileError(f"names {counts}: give each joint all of theta, d, a, alpha", path=str(path))
    return grid_of(list(found), found.values(), source=str(path))


def _constants(headings: Sequence[str]) -> list[str]:
    """Constants under headings, by their last words where none is called so alone; others as they stand."""
    bare = (
        parse_heading(ENDING.sub(r"[\1]", text)).name.lower().removesuffix("_offset") for text in headings
    )
    alone = [NAMES.get(name, name) for name in (INDEX.sub("", name) for name in bare)]
    last = [NAMES.get(word, word) for word in (WORD.findall(name)[0] for name in alone)]
    is_told = [word not in alone and last.count(word) == 1 for word in last]
    return [word if told else name for name, word, told in zip(alone, last, is_told, strict=True)]


def _row(cells: list[tuple[str, str]], grid: Grid, number: int) -> dict[str, Any]:
    kind = KINDS.get(stated := dict(cells).get("type", "revolute").strip().lower())
    if kind is None:
        raise grid.error(f"type is '{stated}'; known: {', '.join(KINDS)}", number)
    row: dict[str, Any] = {"type": kind} | dict.fromkeys(CONSTANTS, 0.0)
    for name, text in ((name, text.strip()) for name, text in cells if name in CONSTANTS):
        if (size := _number(text or "0")) is None:
            raise grid.error(f"{name} is '{text}', which is not a number", number)
        if size and row[name]:  # only a joint's own `q1` and its offset stand beside each other
            raise grid.error(f"{name} is {row[name]:g} and {size:g}: leave the one that counts", number)
        row[name] += size
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


def _units(given: dict[str, str], names: Sequence[str], known: Sequence[str], grid: Grid) -> tuple[str, ...]:
    found = {given[name] for name in names if name in given}
    if len(found) > 1 or not found <= {*known}:
        raise grid.error(f"has units {' and '.join(sorted(found))}; give all in {' or in '.join(known)}")
    return (*found,) or (*known,)


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
) -> list[TableReading]:
    """What a joint table may mean.

    Args:
        rows: `theta`, `d`, `a`, `alpha` (`beta`, `type`) of every joint, as numbers stand there.
        conventions: That may be meant.
        lengths: Units that may be meant, the likeliest first.
        angles: The same for angles.
    """
    if unknown := [unit for unit in (*lengths, *angles) if unit not in SIZES]:
        raise OptionError(f"unknown unit '{unknown[0]}'; choose from {', '.join(SIZES)}")
    titles = {"dh": "standard DH", "craig": "modified DH (Craig)"}
    rows = [_numbers(row, number) for number, row in enumerate(rows, start=1)]
    lengths = possible(lengths, [row.get(key, 0.0) for row in rows for key in ("d", "a")])
    angles = possible(angles, [row.get(key, 0.0) for row in rows for key in ("theta", "alpha", "beta")])
    out, refused = list[TableReading](), list[FileError]()
    for convention, length, angle in product(conventions, lengths, angles):
        sizes = dict.fromkeys(CONSTANTS, SIZES[angle]) | dict.fromkeys(("d", "a"), SIZES[length])
        scaled = [{k: v * sizes[k] if k in sizes else v for k, v in row.items()} for row in rows]
        try:
            robot = robot_from_rows(scaled, convention, name=name)
        except FileError as error:  # units that no arm has
            refused.append(error)
            continue
        assumed = (titles.get(convention, convention), f"lengths in {length}", f"angles in {angle}")
        out.append(TableReading(robot.with_frames(base=Frame(), tool=Frame()), assumed))
    if refused and not out:
        raise refused[-1]
    return out


def possible(units: Sequence[str], values: Sequence[float]) -> Sequence[str]:
    """Those of two units in which some numbers make sense; both where either does."""
    largest = float(np.abs(values).max()) if np.size(values) else 0.0
    quarters = [abs(v) * 2.0 / np.pi for v in values]  # turns of tables in rad; hardly small ones in degrees
    is_rad = any(turn > 0.5 and abs(turn - round(turn)) < 0.01 for turn in quarters)
    bounds = {"m": (0.0, 20.0), "mm": (5.0, np.inf), "rad": (0.0, 2.1 * np.pi)}
    bounds["deg"] = (2.1 * np.pi if is_rad else 1e-9, np.inf)
    kept = [u for u in units if bounds[u][0] <= largest <= bounds[u][1]]
    return kept or units
