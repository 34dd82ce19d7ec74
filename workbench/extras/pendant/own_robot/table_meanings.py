"""Joint tables: what stands in their files, and what it may mean, in conventions and units.

Denavit–Hartenberg constants of a joint stand in each row, with units in the headings or without, or behind
their names, joint by joint, as in JSON, YAML and programs. Four numbers a joint without names may stand in
any order, which poses tell.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, permutations, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.arm.conventions import CONSTANTS
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
TEXTBOOK = {"length": "a", "offset": "d", "angle": "theta"}
"""Other headings of the constants, and those of a table that has all of these."""
KINDS = {"r": "revolute", "p": "prismatic", "continuous": "revolute"} | {str(k): str(k) for k in JointKind}
KINDS |= {"0": "revolute", "1": "prismatic"}
KEYED = re.compile(r"([^\W\d]\w*)(?:[\"']?\s*[:=]|[\"']\s*,)[^\S\n]*(\[[^\]{}]*\]|[^\s,\[\]{}()][^\n,{}()]*)")
"""A key and what stands behind it in JSON, YAML, `Link('d', 0.4)` of MATLAB and `RevoluteDH(d=0.4)`."""
LINK = re.compile(r"\b(?:Link|DHLink|dict|Revolute\w*|(Prismatic)\w*)\s*\(((?:[^()]|\([^()]*\))*)\)")
LINK_ORDER = (*CONSTANTS[:4], "sigma", "offset")
"""A joint of Corke's toolboxes, or a dict, in which 0 may be left out, and the order without names."""
UNSAID = re.compile(r"(?m)(?:^|\s)[#%].*|\b(?:np|numpy|math|sympy)\.|\s+(?=[*/])|(?<=[*/])\s+")
"""Comments, and what may be left out of `2 * np.pi / 3`."""
LENGTHS, ANGLES = ("m", "mm"), ("rad", "deg")
UNITS = {"°": "deg", "degree": "deg", "degrees": "deg"}
ENDING, WORD = re.compile(r"[_ ](deg|rad|mm|m)$", re.I), re.compile(r"[a-zα-ω]*$")
"""A unit behind a name, as in `theta_deg`, and a heading's last word."""
INDEX = re.compile(r"[ _({]*i(?:[-−]1)?[)}]*$|_prev$")
"""Of a constant in a paper, as in `alpha_{i-1}`."""
CALLED = re.compile(r"^.+\((theta|θ|d|a|alpha|α)\)", re.I)
"""A constant's name in brackets, as in `Twist (alpha)`."""
DRIVE = re.compile(r"^(?:q|theta|θ)_?\{?\d*\}?\*?(?=\s*[+-]|$)")
"""The joint itself before its offset, as in `q2-90`."""
SLIDE = re.compile(r"^[dq]_?\{?\d+\}?\*?(?=\s*[+-]|$)", re.I)
"""The same of a sliding joint, in its d."""
SHARE = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)?(?:e[+-]?\d+)?)\*?(pi)?(?:/([1-9]\d*))?")
FourNumbers = tuple[float, float, float, float]
TITLES = {"dh": "standard DH", "craig": "modified DH (Craig)"}
WANTED = "write a table (.csv) with the headings theta, d, a, alpha and a line for each joint"


class JointTable(NamedTuple):
    """A table as it stands in its file.

    Args:
        rows: `type` and constants of every joint, in the file's units; four numbers where they have no names.
        conventions: That it may be of: its own where the file says it.
        lengths: Units of d and a that may be meant.
        angles: The same for the angles.
    """

    rows: tuple[dict[str, Any], ...] | tuple[FourNumbers, ...]
    conventions: tuple[str, ...]
    lengths: tuple[str, ...]
    angles: tuple[str, ...]


def read_joint_table(path: Path | str) -> JointTable:
    """Columns theta, d, a, alpha (beta, type) in any order; a line `# convention = dh` may tell which."""
    grid = _grid(Path(path))
    stated = tuple(m[1] for text in grid.comments if (m := re.match(r"\s*convention\s*=\s*([\w-]+)", text)))
    if len(grid.rows) < 2:
        raise grid.error(f"names no constants of joints; {WANTED}")
    titles = int(np.argmax([{"d", "a", "alpha"} <= {*_constants(cells)} for cells in grid.rows]))
    grid = replace(grid, rows=grid.rows[titles:], lines=grid.lines[titles:])
    first = [cells[0] for cells in grid.rows]
    if {*CONSTANTS[:4]} <= {*_constants(first)} - {*_constants(grid.rows[0])}:  # a line for each constant
        grid = grid_of(first, [cells[1:] for cells in grid.rows], source=grid.source)
    names = _constants(grid.rows[0])
    heads = [CALLED.sub(r"\1", cell) for cell in grid.rows[0]]
    stands = [(parse_heading(ENDING.sub(r"[\1]", cell)).unit or "").lower() for cell in heads]
    if missing := [name for name in ("d", "a", "alpha") if name not in names]:
        if nameless := _nameless(grid.rows):
            return JointTable(nameless, stated[:1] or ("dh", "craig"), LENGTHS, ANGLES)
        raise grid.error(f"has no column {', '.join(missing)}; {WANTED}", 0)
    filled = [(k, cells) for k, cells in enumerate(grid.rows[1:], 1) if {*map(_number, cells)} - {None}]
    named = {k: [*zip(names, cells, strict=False)] for k, cells in filled}
    texts = (text.strip().lower() for own in named.values() for name, text in own if name in CONSTANTS)
    has_drives = any(map(DRIVE.match, texts))
    rows = [_row(own, grid, k, has_drives=has_drives) for k, own in named.items()]
    units = {name: UNITS.get(unit, unit) for name, unit in zip(names, stands, strict=True) if unit}
    for constants, known in ((("d", "a"), LENGTHS), (("theta", "alpha", "beta"), ANGLES)):
        there = [name for name in constants if name in names]
        if {units.get(name) for name in there} == {*known}:  # each in its own
            rows = [row | {name: row[name] * SIZES[units[name]] for name in there} for row in rows]
            units |= dict.fromkeys(there, known[0])
    lengths = _units(units, ("d", "a"), LENGTHS, grid)
    units |= {"°": "deg"} if any("°" in c for cells in grid.rows[1:] for c in cells) else {}
    angles = _units(units, ("theta", "alpha", "beta", "°"), ANGLES, grid)
    return JointTable(tuple(rows), stated[:1] or ("dh", "craig"), lengths, angles)


def _grid(path: Path) -> Grid:
    if path.suffix.lower() not in (".json", ".yaml", ".yml", ".m", ".py"):
        return read_grid(path)
    text = UNSAID.sub("", decode(read_bytes(path), path)[0])
    links = [
        {"sigma": "1" if slides else "0", **dict.fromkeys(CONSTANTS[:4], "0")}
        | (dict(KEYED.findall(own)) or dict(zip(LINK_ORDER, re.findall(r"[^\s,\[\]]+", own), strict=False)))
        for slides, own in LINK.findall(text)
    ]
    found = {key: [own.get(key, "0") for own in links] for key in dict.fromkeys(chain(*links))}
    for key, value in [] if links else KEYED.findall(text):
        found.setdefault(key, []).extend(re.findall(r"[^\s,\"'\[\]]+", value))
    names = dict(zip(found, _constants(list(found)), strict=True))
    found = {key: own for key, own in found.items() if names[key] in (*CONSTANTS, "type")}
    if not {*names.values()} & {*CONSTANTS}:
        blocks = (re.split(r"\n" if len(b.split()) > 5 else "\0", b) for b in re.split(r"[\[\](){};]", text))
        rows = [re.findall(r"[^\s,]+", line) for block in blocks for line in block]
        rows = [row for row in rows if _nameless([row] * 2)]
        return Grid(source=str(path), rows=rows, lines=[*range(1, len(rows) + 1)])
    if len({*map(len, found.values())}) > 1:
        for key in [key for key in found if names[key] == "type" and KINDS.keys().isdisjoint(found[key])]:
            del found[key]  # of something else
    if len({*map(len, found.values())}) > 1:
        counts = ", ".join(f"{len(cells)} of {key}" for key, cells in found.items())
        raise FileError(f"names {counts}: give each joint all of theta, d, a, alpha", path=str(path))
    return grid_of(list(found), found.values(), source=str(path))


def _nameless(rows: Sequence[Sequence[str]]) -> tuple[FourNumbers, ...]:
    """Four numbers a joint, behind its name, its number or neither; none of other cells."""
    numbers = [[n for n in map(_number, row) if n is not None] for row in rows if any(row)]
    is_counted = all(row[:1] == [k] and len(row) == 5 for k, row in enumerate(numbers, 1))
    is_whole = len(numbers) > 1 and all(len(row) == 4 + is_counted for row in numbers)
    return tuple((a, b, c, d) for *_, a, b, c, d in numbers) if is_whole else ()


def _constants(headings: Sequence[str]) -> list[str]:
    """Constants under headings, by their last words where none is called so alone; others as they stand."""
    heads = (CALLED.sub(r"\1", text) for text in headings)
    bare = (parse_heading(ENDING.sub(r"[\1]", text)).name.lower() for text in heads)
    plain = [INDEX.sub("", name.removesuffix("_offset")) for name in bare]
    words = [WORD.findall(name)[0] for name in plain]
    names = NAMES | TEXTBOOK if TEXTBOOK.keys() <= {*words} else NAMES
    alone, last = ([names.get(text, text) for text in texts] for texts in (plain, words))
    is_told = [word not in alone and last.count(word) == 1 for word in last]
    return [word if told else name for name, word, told in zip(alone, last, is_told, strict=True)]


def _row(cells: list[tuple[str, str]], grid: Grid, number: int, *, has_drives: bool) -> dict[str, Any]:
    own = {name: text.strip() for name, text in cells}
    slides = has_drives and SLIDE.match(own.get("d", "")) and not DRIVE.match(own.get("theta", "").lower())
    kind = KINDS.get(stated := own.get("type", "prismatic" if slides else "revolute").lower())
    if kind is None:
        raise grid.error(f"type is '{stated}'; known: {', '.join(KINDS)}", number)
    row: dict[str, Any] = {"type": kind} | dict.fromkeys(CONSTANTS, 0.0)
    for name, text in ((name, text.strip()) for name, text in cells if name in CONSTANTS):
        text = SLIDE.sub("", text) if name == "d" and kind == "prismatic" else text
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
    rows: Sequence[dict] | Sequence[FourNumbers],
    *,
    conventions: Sequence[str] = ("dh", "craig"),
    lengths: Sequence[str] = ("m", "mm"),
    angles: Sequence[str] = ("rad", "deg"),
    name: str = "robot",
) -> list[TableReading]:
    """What a joint table may mean.

    Args:
        rows: `theta`, `d`, `a`, `alpha` (`beta`, `type`) of every joint, as numbers stand there; or four
            numbers of each in any order.
        conventions: That may be meant.
        lengths: Units that may be meant, the likeliest first.
        angles: The same for angles.
    """
    if unknown := [unit for unit in (*lengths, *angles) if unit not in SIZES]:
        raise OptionError(f"unknown unit '{unknown[0]}'; choose from {', '.join(SIZES)}")
    named = [_numbers(row, number) for number, row in enumerate(rows, 1) if isinstance(row, dict)]
    orders = [()] if len(named) == len(rows) else _orders(rows)
    out, refused = dict[tuple, TableReading](), list[FileError]()
    for order in orders:
        table = named or [dict(zip(order, row, strict=True)) for row in rows]
        own = (possible(lengths, table, ("d", "a")), possible(angles, table, ("theta", "alpha", "beta")))
        said = [f"columns {', '.join(order)}"] * bool(order)
        said += ["theta 0"] * (not all("theta" in row for row in table))
        for convention, length, angle in product(conventions, *own):
            sizes = dict.fromkeys(CONSTANTS, SIZES[angle]) | dict.fromkeys(("d", "a"), SIZES[length])
            scaled = [{k: v * sizes[k] if k in sizes else v for k, v in row.items()} for row in table]
            try:
                robot = robot_from_rows(scaled, convention, name=name)
            except FileError as error:  # units that no arm has
                refused.append(error)
                continue
            assumed = (", ".join([TITLES.get(convention, convention), *said]), f"lengths in {length}")
            reading = TableReading(robot.bare, (*assumed, f"angles in {angle}"))
            out.setdefault((convention, *(e.value for e in robot.elements)), reading)
    if refused and not out:
        raise refused[-1]
    return [*out.values()]


def _orders(rows: Sequence[Any]) -> list[tuple[str, ...]]:
    """Orders of the constants of nameless rows; alpha is of quarter turns where any column is."""
    turns = np.array([np.array(rows) / quarter for quarter in (np.pi / 2.0, 90.0)])
    is_right = (abs(turns - turns.round()) <= 0.01 * abs(turns)).all(1).any(0)
    orders = [*permutations(CONSTANTS[:4])]
    return [own for own in orders if is_right[own.index("alpha")]] or orders


def possible(units: Sequence[str], rows: Sequence[dict], names: Sequence[str]) -> Sequence[str]:
    """Those of two units in which some constants make sense; both where either does."""
    values = np.abs([row.get(name, 0.0) for row in rows for name in names])
    largest, quarters = values.max(initial=0.0), values * 2.0 / np.pi
    is_rad = ((quarters > 0.5) & (abs(quarters - quarters.round()) < 0.01)).any()  # hardly small degrees
    bounds = {"m": (0.0, np.inf), "mm": (5.0, np.inf), "rad": (0.0, 2.1 * np.pi)}
    bounds["deg"] = (2.1 * np.pi if is_rad else 1e-9, np.inf)
    return [u for u in units if bounds[u][0] <= largest <= bounds[u][1]] or units
