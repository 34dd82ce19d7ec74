"""Cells of a file and the table they make: which row holds headings, which units, where the data begin."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from workbench.base.errors import FileError, OptionError
from workbench.base.remedy import remedy
from workbench.base.units import is_unit, parse_heading
from workbench.base.wording import listed
from workbench.data.readers.columns_option import IGNORED, NamedUnit, Naming, Pair
from workbench.data.readers.headings import is_known, meaning, normalised

NUMBER = re.compile(r"[-+\u2212]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE)


class Separator(StrEnum):
    """What stands between two fields of a text file."""

    TAB = "\t"
    SEMICOLON = ";"
    COMMA = ","
    BLANKS = " "

    @property
    def text(self) -> str:
        """The separator, as people say it."""
        return {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}[self.value]


@dataclass(frozen=True, eq=False, kw_only=True)
class Grid:
    """Cells as they stand in the file.

    Args:
        source: Path of the file, for messages.
        rows: Cells of each row, stripped; rows may differ in length.
        lines: Line (or spreadsheet row) of each row, counted from 1.
        separator: What parts the fields; None where the format itself does (xlsx, parquet, mat).
        comments: Comment lines before the first row, without their '#'.
        notes: Decisions taken so far.
    """

    source: str
    rows: list[list[str]]
    lines: list[int]
    separator: Separator | None = None
    comments: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def error(self, message: str, row: int | None = None) -> FileError:
        """An error that names the file, and the line of a row."""
        return FileError(message, path=self.source, line=None if row is None else self.lines[row])


@dataclass(frozen=True, eq=False, kw_only=True)
class Table:
    """Named columns of text.

    Args:
        source: Path of the file, for messages.
        headings: Text over each column, with the unit if it stands there.
        units: Unit of each column from a row of units below the headings; "" where none.
        heading_line: Line of the headings.
        columns: Cells of each column, one a data row.
        lines: Line of each data row.
        separator: As in `Grid`.
        notes: Decisions taken so far.
        own: The file's text over each column, where the caller says what they are; empty where headings do.
    """

    source: str
    headings: tuple[str, ...]
    units: tuple[str, ...]
    heading_line: int | None
    columns: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    separator: Separator | None = None
    notes: tuple[str, ...] = field(default=())
    own: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of data rows."""
        return len(self.lines)

    def error(self, message: str, index: int | None = None, row: int | None = None) -> FileError:
        """An error that names the file, the column at an index, and the line of a data row."""
        line = None if row is None else self.lines[row]
        column = None if index is None else self.headings[index]
        return FileError(message, path=self.source, line=line, column=column)


def recognised_headings(grid: Grid) -> int:
    """How many columns the best heading row of a grid names; a lone one is chance, and counts as none."""
    known = max((_known(row) for row in grid.rows[: _first_data_row(grid.rows)]), default=0)
    return known if known > 1 else 0


def with_headings(grid: Grid) -> Table:
    """The table under the grid's own heading row."""
    start = _first_data_row(grid.rows)
    if start == 0 and (named := _commented_headings(grid)) is not None:
        return named
    if start == 0:
        raise grid.error(
            f"the file has no header: write the names of its {len(grid.rows[0])} columns above the numbers, "
            "such as q1[deg],…,x[mm],y[mm],z[mm]"
            + remedy(", or say them with columns='q1[deg],…,-,x[mm]' (--columns)", page=""),
            0,
        )
    head = max(range(start), key=lambda i: (_known(grid.rows[i]), i))
    if not _known(grid.rows[head]):
        if start == len(grid.rows) > 1:
            raise grid.error("it has no row of numbers: this is not a table of measurements")
        raise grid.error(
            f"none of the headings {listed(grid.rows[head])} is known: name the columns q1[rad], …, x[m], "
            "y[m], z[m]" + remedy(", or say what they are with columns='q1[deg]=…' (--columns)", page=""),
            head,
        )
    return _below(grid, head=head, start=start)


def with_names(grid: Grid, names: tuple[str, ...]) -> Table:
    """The table with column names that the caller gives; heading rows of the file are skipped."""
    start = _first_data_row(grid.rows)
    notes: tuple[str, ...] = (f"the columns are named {', '.join(names)}, as requested",)
    if start:
        notes += (f"{start} row(s) above the data are skipped, since the columns were named",)
    return _table(grid, start, names, ("",) * len(names), None, notes)


def _below(grid: Grid, *, head: int, start: int) -> Table:
    """The table under heading row `head`, whose numbers begin at row `start`."""
    headings = list(grid.rows[head])
    while headings and not headings[-1]:
        headings.pop()
    units, notes = ("",) * len(headings), tuple[str, ...]()
    body = head + 1
    if body < len(grid.rows) and _are_units(grid.rows[body]):
        units = tuple(_bare_unit(cell) for cell in _padded(grid.rows[body], len(headings)))
        notes = (f"units are taken from line {grid.lines[body]}, below the headings",)
        body += 1
    if head:
        notes += (f"{head} row(s) above the headings (line {grid.lines[head]}) are skipped",)
    if body < start < len(grid.rows) and not _is_data_like(grid.rows[body], len(headings)):
        notes += (f"{start - body} row(s) between headings and data are skipped",)
        body = start
    return _table(grid, body, tuple(headings), units[: len(headings)], grid.lines[head], notes)


def _table(
    grid: Grid,
    start: int,
    headings: tuple[str, ...],
    units: tuple[str, ...],
    heading_line: int | None,
    notes: tuple[str, ...],
) -> Table:
    """Rows from `start` on as columns."""
    width, rows = len(headings), grid.rows[start:]
    _refuse_torn_numbers(grid, start, width)
    even = [row if len(row) == width else _fitted(grid, i, width) for i, row in enumerate(rows, start)]
    columns = tuple(zip(*even, strict=True)) if even else ((),) * width
    return Table(
        source=grid.source,
        headings=headings,
        units=units,
        heading_line=heading_line,
        columns=columns,
        lines=tuple(grid.lines[start:]),
        separator=grid.separator,
        notes=grid.notes + notes,
    )


def _fitted(grid: Grid, index: int, width: int) -> list[str]:
    """A row cut or filled to the width where only empty cells are at stake."""
    row = grid.rows[index]
    if len(row) < width and grid.separator is None:
        return _padded(row, width)  # spreadsheets leave trailing cells out
    if len(row) > width and not any(row[width:]):
        return row[:width]
    raise grid.error(
        f"this row has {len(row)} fields but {width} are named: add or remove fields, or delete the row",
        index,
    )


def _refuse_torn_numbers(grid: Grid, start: int, width: int) -> None:
    """Raise when commas seem to part fields and to mark decimals in the same file."""
    rows = grid.rows[start:]
    if grid.separator is not Separator.COMMA or not rows:
        return
    if all(any(row[width:]) and not any("." in cell for cell in row) for row in rows[:50]):
        raise grid.error(
            f"commas separate the fields and seem to mark decimals too ({width} names, {len(rows[0])} "
            "fields): save the table with semicolons between the fields, or with decimal points",
            start,
        )


def _commented_headings(grid: Grid) -> Table | None:
    """The table named by the last comment line before the data, if that holds headings that fit."""
    width = len(grid.rows[0])
    for comment in reversed(grid.comments):
        for cells in (re.split(r"[,;\t]", comment), re.sub(r"\s+\[", "[", comment).split()):
            names = tuple(cell.strip() for cell in cells)
            if len(names) == width and _known(list(names)) >= 2:
                note = ("the headings are taken from a comment line",)
                return _table(grid, 0, names, ("",) * width, None, note)
    return None


def _first_data_row(rows: list[list[str]]) -> int:
    """Index of the first row that is at least half numbers; the number of rows when there is none."""
    for i, row in enumerate(rows):
        filled = [cell for cell in row if cell]
        numbers = sum(bool(NUMBER.fullmatch(cell)) for cell in filled)
        if numbers and 2 * numbers >= len(filled):
            return i
    return len(rows)


def _is_data_like(row: list[str], width: int) -> bool:
    """Whether a row above the first numbers should be read (and complained about) as data."""
    return len(row) == width and any(NUMBER.fullmatch(cell) for cell in row)


def _known(row: list[str]) -> int:
    """How many cells are headings that we know."""
    return sum(bool(cell) and is_known(cell) for cell in row)


def _are_units(row: list[str]) -> bool:
    """Whether all filled cells of a row are units (or a dash)."""
    filled = [_bare_unit(cell) for cell in row if cell and cell not in ("-", "–")]
    return bool(filled) and all(is_unit(cell) for cell in filled)


def _bare_unit(cell: str) -> str:
    return cell.strip().strip("[]()").strip()


def _padded(row: list[str], width: int) -> list[str]:
    return (list(row) + [""] * width)[: max(width, len(row))]


def with_pairs(grid: Grid, naming: Naming) -> Grid:
    """The grid with headings replaced at once by what the caller says they are, so that two may change
    places; others of the same meaning are dropped."""
    end = _first_data_row(grid.rows)
    rows, notes = [list(row) for row in grid.rows[:end]], grid.notes
    given: dict[tuple[int, int], NamedUnit] = {}
    for pair in naming.pairs:
        ours, theirs = pair.right[0], pair.left
        sides = [(theirs.name, ours)]
        if not naming.is_mapping and ours.name != IGNORED:  # either side may be the file's
            sides = [side for side in ((ours.name, theirs), *sides) if meaning(side[1].name) is not None]
        found = (dict.fromkeys(_places(rows, name), item) for name, item in sides)
        places = next(filter(None, found), {})
        if not places and ours.name != IGNORED:
            raise _no_column(rows, pair, grid.source)
        given |= places
    taken = {meaning(item.name) for item in given.values() if item.name != IGNORED}
    for i, row in enumerate(rows):
        for j, cell in enumerate(row):
            name, unit = parse_heading(cell)
            item = given.get((i, j))
            if item is not None and item.name != IGNORED:
                row[j] = NamedUnit(item.name, unit if item.unit is None else item.unit).heading()
                notes += (f"column '{cell}' is read as {row[j]}",) if row[j] != cell else ()
            elif cell and (item is not None or (meaning(name) is not None and meaning(name) in taken)):
                row[j] = f"{cell} (not used)"
                notes += (f"column '{cell}' is left out",) if item is not None else ()
    return replace(grid, rows=rows + grid.rows[end:], notes=notes)


def with_joint_names(grid: Grid, names: Sequence[str]) -> Grid:
    """The grid with joints called as the robot's file does renamed to q1, q2, …, if it has them all."""
    for i, row in enumerate(grid.rows[: _first_data_row(grid.rows)]):
        places = {_joint_name(parse_heading(cell).name): j for j, cell in enumerate(row) if cell}
        found = [places.get(_joint_name(name)) for name in names]
        numbers = [j for j in found if j is not None]
        if len(set(numbers)) < len(names):
            continue
        renamed = list(row)
        for k, j in enumerate(numbers, start=1):
            renamed[j] = NamedUnit(f"q{k}", parse_heading(row[j]).unit).heading()
        note = f"{listed([row[j] for j in numbers])} are the robot's joints, by their names in its file"
        rows = [*grid.rows[:i], renamed, *grid.rows[i + 1 :]]
        return grid if renamed == row else replace(grid, rows=rows, notes=(*grid.notes, note))
    return grid


def _joint_name(name: str) -> str:
    """A joint's name as it is compared: 'shoulder' and 'shoulder_joint' are one."""
    return normalised(name).removesuffix("_joint")


def _no_column(rows: list[list[str]], pair: Pair, source: str) -> OptionError:
    cells = [cell for row in rows for cell in row if cell]
    return OptionError(
        f"{source}: '{pair.left.name}={pair.right[0].name}' names no known column of the file: "
        f"the headings are {listed(cells)}"
    )


def _places(rows: list[list[str]], name: str) -> list[tuple[int, int]]:
    """Row and column of every heading of this name, with or without its unit."""
    cells = [(i, j, cell) for i, row in enumerate(rows) for j, cell in enumerate(row) if cell]
    return [(i, j) for i, j, cell in cells if name in (cell, parse_heading(cell).name)]
