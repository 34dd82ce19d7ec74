"""Cells of a file and the table they make: where its headings and rows are, and what each column is.

What a column is stands in one form wherever it comes from, `q1[deg]`, or `-` where it is left out: its
heading says it, a row of units below adds the unit, the robot's joints have their names, and what the caller
says goes before all of these.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, chain, groupby, pairwise, repeat, zip_longest
from typing import NamedTuple

from workbench.arm.robot import Robot
from workbench.base.errors import FileError, OptionError
from workbench.base.remedy import remedy
from workbench.base.units import is_unit, parse_heading
from workbench.base.wording import listed
from workbench.data.readers.columns_option import AS_HEADED, IGNORED, Joints, Naming
from workbench.data.readers.headings import (
    COMMAND,
    COUNTERS,
    is_observed,
    joint_name,
    known_together,
    meaning,
    meaning_of,
    normalised,
    number_in,
    quantities_of,
    split_ending,
    unit_apart,
)

NUMBER = re.compile(
    r"(?i)[-+\u2212]?(\d+([ ,.'’\u00a0\u202f]\d{3})*([.,]\d*)?|[.,]\d+)(e[-+]?\d+|d[-+]\d+)?-?|[-+]?(nan|inf)"
)
_INDEXED = re.compile(r"(.+?)\s*\[(\d+)\]")
_NAME, _POSITION = re.compile(r"(.*)name_?(\d+)"), re.compile(r"(.*)position_?(\d+)(\s*\[.*\])?")
_COMMA = re.compile(r"[-+\u2212]?\d*,\d+([eE][-+]?\d+)?-?")
_POINT = re.compile(r"[-+\u2212]?(\d+\.\d*|\.\d+)([eE][-+]?\d+)?")
_OF_UNIT = re.compile(r"([-+\u2212]?[\d.,]*\d)\s?(°|deg|rad|mm|cm|m|µm|um|inch)")
_THOUSANDS = re.compile(r"[-+\u2212]?[1-9]\d{0,2},\d{3}")
_AXES = {"XYZ", "xyz"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Grid:
    """Cells as they stand in the file, with the decisions taken so far.

    Args:
        rows: Cells of each row, stripped; rows may differ in length.
        lines: Line (or spreadsheet row) of each row, counted from 1.
        is_text: Whether separators part the cells, so that a row that lacks some is an error.
        comments: Comment lines before the first row, without their '#'.
    """

    source: str
    rows: list[list[str]]
    lines: list[int]
    is_text: bool = False
    comments: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def error(self, message: str, row: int | None = None) -> FileError:
        """An error that names the file, and the line of a row."""
        return FileError(message, path=self.source, line=None if row is None else self.lines[row])


@dataclass(frozen=True, eq=False, kw_only=True)
class Table:
    """Named columns of text, with the decisions taken so far.

    Args:
        headings: The file's text over each column.
        names: What each column is, as `q1[deg]`; `-` where it is left out.
        heading_line: Line of the headings.
        columns: Cells of each column, one a data row.
        lines: Line of each data row.
        has_option: Whether the caller could have said what the columns are.
    """

    source: str
    headings: tuple[str, ...]
    names: tuple[str, ...]
    heading_line: int | None
    columns: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    notes: tuple[str, ...] = ()
    has_option: bool = True

    def error(self, message: str, index: int | None = None, row: int | None = None) -> FileError:
        """An error that names the file, the column at an index, and the line of a data row or its heading."""
        line = self.lines[row] if row is not None else None if index is None else self.heading_line
        column = None if index is None else self.headings[index]
        return FileError(message, path=self.source, line=line, column=column)


def grid_of(
    names: Sequence[str], columns: Iterable[Sequence[str]], *, source: str, notes: Sequence[str] = ()
) -> Grid:
    """Columns of cells under a row of headings."""
    rows = [list(names), *map(list, zip(*columns, strict=True))]
    return Grid(source=source, rows=rows, lines=list(range(len(rows))), notes=tuple(notes))


def with_points(grid: Grid) -> Grid:
    """The cells with decimal points, where all numbers have commas; a unit behind the numbers of a column
    stands in its heading instead."""
    for k in [k for k, cell in enumerate(grid.rows[len(grid.rows) // 2]) if _OF_UNIT.fullmatch(cell)]:
        cells = enumerate("".join(row[k : k + 1]) for row in grid.rows)
        found = {i: match for i, cell in cells if (match := _OF_UNIT.fullmatch(cell))}
        units, begin = {match[2].replace("°", "deg") for match in found.values()}, min(found)
        for heading in grid.rows[begin - 1][k : k + 1] if begin else ():
            name, said = parse_heading(heading)
            is_number = quantities_of(meaning_of(name) or "x")
            if is_number and len(units | {said.replace("°", "deg")} if said else units) == 1:
                grid.rows[begin - 1][k] = _with_unit(heading, min(units))
                for i, match in found.items():
                    grid.rows[i][k] = match[1]
    commas = [(cell, k) for k, row in enumerate(grid.rows) for cell in row if _COMMA.fullmatch(cell)]
    if not commas:
        return grid
    points = (cell for row in grid.rows for cell in row if _POINT.fullmatch(cell))
    if (point := next(points, "") * grid.is_text) or all(_THOUSANDS.fullmatch(cell) for cell, _ in commas):
        text = f"'{commas[0][0]}' has a decimal comma" + (f", '{point}' a decimal point" if point else "")
        raise grid.error(f"{text}, or commas group thousands: write all numbers with points", commas[0][1])
    rows = [[cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in r] for r in grid.rows]
    return replace(grid, rows=rows, notes=(*grid.notes, "decimal commas"))


def turned(grid: Grid) -> Grid:
    """The grid with its headings above where they stand in the first column, beside one for each pose."""
    grid = _with_axes(grid)
    keys = {*keys_of([cell for row in grid.rows for cell in row[:1]])}
    if "q1" not in keys or not any(map(is_observed, keys)) or named_keys(grid):
        return grid
    rows = [*map(list, zip_longest(*grid.rows, fillvalue=""))]
    notes = *grid.notes, "the headings stand in the first column: each other column is a row"
    return replace(grid, rows=rows, lines=[*range(1, len(rows) + 1)], notes=notes)


def _with_axes(grid: Grid) -> Grid:
    """The grid with one row a point where X, Y and Z stand in three, named in a column, as of PolyWorks."""
    head, *body = grid.rows or [[]]
    first = {"".join(cells) for cells in zip(*body[:3], strict=False)}
    if len(body) < 4 or first.isdisjoint(_AXES):
        return grid
    even = [[*row, *[""] * (len(head) - len(row))] for row in body]
    bodies = [even[k : k + 3] for k in range(0, len(even), 3)]
    columns = [[[row[k] for row in own] for own in bodies] for k in range(len(head))]
    axes = [k for k, own in enumerate(columns) if {*map("".join, own)} <= _AXES]
    if not axes:
        return grid
    found = list[list[str]]()
    for k in filter(axes[0].__ne__, range(len(head))):
        is_shared = all(len({*three} - {""}) < 2 for three in columns[k])
        apart = ([f"{a} {head[k]}", *(three[i] for three in columns[k])] for i, a in enumerate("XYZ"))
        found += [[head[k], *map(max, columns[k])]] if is_shared else apart
    rows = [*map(list, zip(*found, strict=True))]
    known, keys = {*keys_of(head)}, {*keys_of(rows[0])}
    if not (known <= keys and {*"xyz"} <= keys - known):  # X, Y and Z are names, or ways, of something else
        return grid
    notes = *grid.notes, "X, Y and Z of a point stand in three rows"
    return replace(grid, rows=rows, lines=[grid.lines[0], *grid.lines[1::3]], notes=notes)


class _Part(NamedTuple):
    """A table in a grid: rows of its title and of its headings, and what these name."""

    begin: int
    start: int
    keys: list[str]


def only_table(grid: Grid) -> Grid:
    """The grid of the one table that was meant, if there are several; those with equal headings are one.

    Raises:
        FileError: several may be meant; it names their lines.
    """
    parts = _parts(grid)
    meant = [p for p in parts if any(re.fullmatch(r"q\d+", key) for key in p.keys)]
    meant = meant or [part for part in parts if len(part.keys) > 1]
    if len(parts) < 2 or not meant:
        return grid
    heading = grid.rows[meant[0].start]
    titles = [" ".join(chain(*grid.rows[part.begin : part.start])) for part in meant]
    ends = dict(pairwise([*(part.begin for part in parts), len(grid.rows)]))
    is_titled = len({re.sub(r"[\d\W_]+", " ", title) for title in titles if title}) > 1  # not as pages are
    is_alike = len(parts) == len(meant) and all(grid.rows[part.start] == heading for part in meant)
    if is_alike and not (is_titled and _repeat_postures([grid.rows[p.start : ends[p.begin]] for p in meant])):
        again = {row for part in meant[1:] for row in range(part.begin, part.start + 1)}
        kept = [pair for k, pair in enumerate(zip(grid.rows, grid.lines, strict=True)) if k not in again]
        every, at = map(list, zip(*kept, strict=True))
        return replace(grid, rows=every, lines=at, notes=(*grid.notes, "repeated headings are skipped"))
    lines = [f"lines {grid.lines[part.start]}–{grid.lines[ends[part.begin] - 1]}" for part in meant]
    if len(meant) > 1:
        named = [f"'{title[:40]}' in {at}" if title else at for title, at in zip(titles, lines, strict=True)]
        raise grid.error(f"holds several tables ({', '.join(named)}); keep one of them")
    note = f"of {len(parts)} tables the one in {lines[0]} is read"
    rows = slice(meant[0].start, ends[meant[0].begin])
    return replace(grid, rows=grid.rows[rows], lines=grid.lines[rows], notes=(*grid.notes, note))


def _repeat_postures(tables: list[list[list[str]]]) -> bool:
    """Whether more than a quarter of the postures of tables are measured again in others of them."""
    joints = [k for k, cell in enumerate(tables[0][0]) if re.fullmatch(r"q\d+", meaning_of(cell) or "")]
    posture = lambda row: tuple(round(number_in(cell), 1) for k in joints for cell in row[k : k + 1])  # noqa: E731
    each = [{*map(posture, rows)} for _, *rows in tables]
    return bool(joints) and len(set().union(*each)) < 0.75 * sum(map(len, each))


def _parts(grid: Grid) -> list[_Part]:
    """Tables begin where text stands above numbers, and two names are known or the width is another."""
    found, width, row = list[_Part](), 0, 0
    for is_text, run in groupby(grid.rows, lambda cells: not any(map(NUMBER.fullmatch, cells))):
        cells = list(run)
        if is_text:
            names = max(cells, key=lambda line: (len(keys_of(line)), len(line)))
            known = keys_of(names)
            below = grid.rows[row + len(cells)] if row + len(cells) < len(grid.rows) else []
            if below and sum(map(bool, names)) > 1 and (len(known) > 1 or len(below) != width):
                width = len(below)
                found.append(_Part(row, row + cells.index(names), known))
        row += len(cells)
    return found


def named_keys(grid: Grid) -> set[str]:
    """What the best heading row of a grid names."""
    rows = grid.rows[: _first_data_row(grid.rows)]
    best: list[str] = max(map(keys_of, rows), key=len, default=[])
    return set(best)


def keys_of(row: list[str]) -> list[str]:
    """Of the cells that are headings that we know."""
    return [key for cell in row if cell and (key := meaning_of(cell)) is not None]


def with_headings(grid: Grid, naming: Naming | None = None, joints: Joints = None) -> Table:
    """The table under the grid's heading row; its columns may have the names of the robot's joints."""
    start, has_option = _first_data_row(grid.rows), naming is not AS_HEADED
    grid = replace(grid, rows=[*map(_without_indices, grid.rows[:start]), *grid.rows[start:]])
    said = _said(grid, start, naming, joints) if start else {}
    keys = [[said.get(c, meaning_of(COMMAND.sub("", c))) for c in row if c] for row in grid.rows[:start]]
    known = [sum(key not in (None, IGNORED) for key in row) for row in keys]
    if not any(known):  # names that mean something together
        cells = [*zip_longest(*grid.rows[start:], fillvalue="")]
        rows = (dict(zip(map(normalised, row), cells, strict=False)) for row in grid.rows[:start])
        together = [{*known_together(own).values()} for own in rows]
        known = [len(own) * ("x" in own) for own in together]
    if not any(known):  # units alone tell a row of headings, in whatever language
        known = [sum(unit_apart(cell)[1] is not None for cell in row) for row in grid.rows[:start]]
    head = max(range(start), key=lambda i: (known[i], i), default=0)
    if not any(known):
        if start == len(grid.rows) > 1:
            raise grid.error("it has no row of numbers: this is not a table of joints or poses")
        unknown = f"none of the headings {listed(grid.rows[head], longest=3)} is known"
        found = unknown if start else "there is no header"
        option = remedy(", or say what they are with columns='q1[deg],…,-,x[mm]' (--columns)", page="")
        wanted = f"name the {len(grid.rows[-1])} columns q1[deg], …, x[mm], y[mm], z[mm] above the numbers"
        raise grid.error(f"{found}: {wanted}{option * has_option}", head)
    headings = list(grid.rows[head])
    if head:  # 'X' under 'Tracker', beside 'X' under 'Robot'
        above = chain(grid.rows[head - 1], repeat(""))
        groups: Iterable[str] = accumulate(above, lambda a, b: b or a)
        over = zip(headings, map(parse_heading, groups), strict=False)
        named = [_with_unit(f"{g.name} {h}", g.unit or "") for h, g in over]
        told = {n for n in named if named.count(n) == 1 or meaning_of(n)}  # no title over both
        pairs = [*zip(headings, named, strict=True)]
        headings = [n if h and headings.count(h) > 1 and n in told else h for h, n in pairs]
    while headings and not headings[-1]:
        headings.pop()
    body, units, notes = head + 1, [""] * len(headings), list[str]()
    below = grid.rows[body] if body < len(grid.rows) else []
    filled = [cell.strip("[]() \u00a0") for cell in below if cell and cell not in ("-", "–")]
    if filled and all(map(is_unit, filled)):
        units = [cell.strip("[]() \u00a0") for cell in _fitted(grid, body, len(headings))]
        notes.append(f"units are taken from line {grid.lines[body]}, below the headings")
        body += 1
    if head:
        notes.append(f"{head} row(s) above the headings (line {grid.lines[head]}) are skipped")
    names = [_with_unit(said.get(h, h), unit) for h, unit in zip(headings, units, strict=False)]
    for heading in headings:
        if (ours := said.get(heading, heading)) != heading:
            notes.append(f"column '{heading}' is {'left out' if ours == IGNORED else f'read as {ours}'}")
    table = _table(grid, body, headings, names, grid.lines[head], notes)
    return _numbered_alike(replace(table, has_option=has_option), grid.rows[head])


def _numbered_alike(table: Table, texts: list[str]) -> Table:
    """The table with a second part beside the first in the order of its rows, where one heading numbers both:
    the joints stand in one of them, what was observed in the other."""
    start = max((k for k, text in enumerate(texts) if normalised(text) in COUNTERS), default=0)
    first, second = table.columns[texts.index(texts[start])], table.columns[start]
    place = {number: k for k, number in enumerate(second)}
    parts = (keys_of([*names]) for names in (table.names[:start], table.names[start:]))
    are_apart = {("q1" in own, any(map(is_observed, own))) for own in parts} == {(True, False), (False, True)}
    if not are_apart or first == second or len(place) < len(second) or place.keys() != {*first}:
        return table
    at = [place[number] for number in first]
    moved = (tuple(own[k] for k in at) for own in table.columns[start:])
    note = f"columns from '{table.headings[start]}' on are joined by their numbers of rows"
    return replace(table, columns=(*table.columns[:start], *moved), notes=(*table.notes, note))


def _without_indices(cells: list[str]) -> list[str]:
    """Headings such as 'q[0]', 'q[1]' … as 'q_0', 'q_1' …: numbers in brackets that count are no units."""
    found = [_INDEXED.fullmatch(cell) for cell in cells]
    stems = [match[1] for match in found if match]
    return [f"{m[1]}_{m[2]}" if m and stems.count(m[1]) > 1 else c for c, m in zip(cells, found, strict=True)]


def with_names(grid: Grid, names: tuple[str, ...]) -> Table:
    """The table with column names that the caller gives; heading rows of the file are skipped."""
    start = _first_data_row(grid.rows)
    notes = [f"the columns are named {', '.join(names)}, as requested"]
    if start:
        notes.append(f"{start} row(s) above the data are skipped, since the columns were named")
    return _table(grid, start, names, names, None, notes)


def _said(grid: Grid, start: int, naming: Naming | None, joints: Joints) -> dict[str, str]:
    """What the caller's names and the robot's joints say of headings."""
    cells = [cell for row in grid.rows[:start] for cell in row if cell]
    said, naming = dict[str, str](), naming or AS_HEADED
    for theirs, (ours, *_) in naming.pairs:
        sides = [(theirs.name, ours)]
        if ours.name != IGNORED:  # either side may be the file's, unless a mapping says which
            both = sides if naming.is_mapping else [(ours.name, theirs), *sides]
            sides = [side for side in both if meaning(side[1].name) is not None]
        found = ({c: side for c in cells if name in (c, parse_heading(c).name)} for name, side in sides)
        named = next(filter(None, found), {})
        if not named and ours.name != IGNORED:
            wrong = f"names no known column of the file: the headings are {listed(cells)}"
            if {theirs.name, ours.name} & {parse_heading(c).name for c in cells}:
                wrong = "gives no known meaning, such as q1, x, roll, pitch, yaw, qw"
            raise OptionError(f"{grid.source}: '{theirs.name}={ours.name}' {wrong}")
        for cell, side in named.items():
            _, unit = split_ending(cell, side.name) or parse_heading(cell)
            said[cell] = _with_unit(side.heading(), unit or "")
    taken = {key for ours in said.values() if (key := meaning(parse_heading(ours).name))}
    left = (cell for cell in cells if cell not in said and meaning(parse_heading(cell).name) in taken)
    has_joints = any(re.fullmatch(r"q\d+", key) for key in taken)
    of_robot = {} if has_joints else _of_robot(cells, _words(grid, start), joints)
    return of_robot | said | dict.fromkeys(left, IGNORED)


def _of_robot(cells: list[str], words: dict[str, str], joints: Joints) -> dict[str, str]:
    """What headings mean by the names of the robot's joints; some have joints' names in cells."""
    joints = joints.joint_names if isinstance(joints, Robot) else joints
    names = joints if isinstance(joints, Sequence) else ()
    places = {joint_name(words.get(cell, parse_heading(cell).name)): cell for cell in cells}
    called = [cell for name in names if (cell := places.get(joint_name(name))) is not None]
    keys = {cell: f"q{k}" for k, cell in enumerate(called, 1)}
    if not names or len(keys) < len(names):  # some of the robot's joints are called otherwise
        keys = {cell: key for cell, word in words.items() if (key := meaning(word)) and key[0] == "q"}
        keys = keys if len(set(keys.values())) == len(words) else {}
    return {cell: _with_unit(key, parse_heading(cell).unit or "") for cell, key in keys.items()}


def _words(grid: Grid, start: int) -> dict[str, str]:
    """Of headings such as 'field.position0' the joint's name, where all rows hold it under 'field.name0'."""
    heads = [(k, cell) for cells in grid.rows[:start] for k, cell in enumerate(cells)]
    stems = ((match.groups(), k) for k, cell in heads if (match := _NAME.fullmatch(cell)))
    words = {stem: {row[k] for row in grid.rows[start:] if k < len(row)} for stem, k in stems}
    known = ((c, words.get((m[1], m[2]), set())) for _, c in heads if (m := _POSITION.fullmatch(c)))
    return {cell: next(iter(word)) for cell, word in known if len(word) == 1}


def _with_unit(name: str, unit: str) -> str:
    return f"{name}[{unit}]" if unit and parse_heading(name).unit is None else name


def _table(
    grid: Grid, start: int, headings: Sequence[str], names: Sequence[str], line: int | None, notes: list[str]
) -> Table:
    """Rows from `start` on as columns."""
    even = [_fitted(grid, k, len(headings)) for k in range(start, len(grid.rows))]
    return Table(
        source=grid.source,
        headings=tuple(headings),
        names=tuple(names),
        heading_line=line,
        columns=tuple(zip(*even, strict=True)) if even else ((),) * len(headings),
        lines=tuple(grid.lines[start:]),
        notes=(*grid.notes, *notes),
    )


def _fitted(grid: Grid, index: int, width: int) -> list[str]:
    """A row cut or filled to the width where only empty cells are at stake."""
    row = grid.rows[index]
    filled = row if grid.is_text else row + [""] * width  # spreadsheets leave trailing cells out
    if len(filled) >= width and not any(filled[width:]):
        return filled[:width]
    too_many = "remove some, as a comma that marks decimals can't separate fields too"
    how = too_many if len(row) > width else "the line breaks off; add fields (- for none)"
    wrong = f"this row has {len(row)} fields but {width} are named"
    raise grid.error(f"{wrong}: {how}, or delete the row; a file holds one table", index)


def _first_data_row(rows: list[list[str]]) -> int:
    """Index of the first row that is at least half numbers; the number of rows when there is none."""
    are_numbers = ([NUMBER.fullmatch(cell) is not None for cell in row if cell] for row in rows)
    return next((i for i, own in enumerate(are_numbers) if 2 * sum(own) >= len(own) > 0), len(rows))
