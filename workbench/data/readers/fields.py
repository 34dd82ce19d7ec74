"""Columns in SI by their names in formats.md, from cells of text: what readers and layouts pass on.

Whether '1,5' is a number is decided once for a file: decimal commas and decimal points in the same file, or
commas that could as well group thousands, are refused.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from enum import StrEnum

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import DataError, FileError
from workbench.base.wording import of_cell
from workbench.data.readers.column_meanings import TableColumn, decisions, interpret_columns, problems
from workbench.data.readers.table import Table

MISSING = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "?", "missing"})
_COMMA = re.compile(r"[-+\u2212]?(\d+,\d*|,\d+)([eE][-+]?\d+)?")
_POINT = re.compile(r"[-+\u2212]?(\d+\.\d*|\.\d+)([eE][-+]?\d+)?")
_BOTH = re.compile(r"[-+\u2212]?\d[\d.,' ]*[.,]\d+[.,]\d+([eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+\u2212]?[1-9]\d{0,2},\d{3}")


MAX_NUMBER = 1e50
"""Larger numbers are no measurements, and their squares no numbers."""


class Decimal(StrEnum):
    """What marks decimals in a file."""

    POINT = "."
    COMMA = ","


@dataclass(frozen=True, eq=False, kw_only=True)
class Fields:
    """One array a column, one value a row.

    Args:
        source: Path, for messages.
        lines: Line of each row in the file.
        values: Numbers in SI (NaN: missing) or labels, by the column's name in formats.md.
        headings: The file's text over each of them.
        units: The file's unit of each of them, where a layout knows it.
        began: Date of the first row, where `time` was read from dates and counts from there.
        rotation: Orientations that a layout has already made, in place of columns; NaN where missing.
        notes: Decisions taken so far.
        unread: Text of columns that are left out, by the file's text over them.
        unsaid: What is wrong where units are missing that the rows may tell.
    """

    source: str
    lines: tuple[int, ...]
    values: Mapping[str, np.ndarray]
    headings: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    began: datetime | None = None
    rotation: Float[np.ndarray, "rows 3 3"] | None = None
    notes: tuple[str, ...] = ()
    unread: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unsaid: str = ""

    @property
    def rows(self) -> int:
        return len(self.lines)

    def stacked(
        self, keys: Sequence[str], *, missing: float | None = None
    ) -> Float[np.ndarray, "rows columns"] | None:
        """Some columns side by side; None where the file has none of them.

        Args:
            keys: Their names.
            missing: What stands for a column that is not there; None: all must be there, or none.
        """
        absent = [key for key in keys if key not in self.values]
        if len(absent) == len(keys):
            return None
        if absent and missing is None:
            given, lacking = ", ".join(k for k in keys if k in self.values), ", ".join(absent)
            raise FileError(f"{given} without {lacking}: add the column(s) {lacking}", path=self.source)
        blank = np.full(self.rows, np.nan if missing is None else missing)
        return np.stack([self.values.get(key, blank) for key in keys], axis=1)

    def take(self, rows: Int[np.ndarray, " n"]) -> "Fields":
        """The chosen rows, in the order given."""
        return replace(
            self,
            values={key: values[rows] for key, values in self.values.items()},
            rotation=None if self.rotation is None else self.rotation[rows],
            lines=tuple(self.lines[int(i)] for i in rows),
        )

    def numbers(self, pattern: str) -> list[int]:
        """Numbers of the columns whose names match a pattern with one group, such as `q(\\d+)`, in order."""
        return sorted({int(m[1]) for key in self.values if (m := re.fullmatch(pattern, key))})

    def error(self, message: str, row: int, key: str | None = None) -> FileError:
        """An error that names the row's line and the column as the file calls it."""
        column = self.headings.get(key, key) if key is not None else None
        return FileError(message, path=self.source, line=self.lines[row], column=column)


def fields_of(table: Table, *, rows_tell: bool = False) -> Fields:
    """All columns of a table that are understood, in SI.

    Args:
        rows_tell: Whether units may be missing that the rows tell (`Dataset.unsaid`).
    """
    columns = interpret_columns(table)
    for problem in problems(columns, rows_tell=rows_tell):
        raise problem
    missing = problems(columns, rows_tell=False)
    return replace(convert(table, columns), unsaid=str(missing[0]) if missing else "")


def convert(table: Table, columns: tuple[TableColumn, ...]) -> Fields:
    """The understood columns in SI."""
    if not table.rows:
        raise DataError(f"{table.source}: there is a header but no data row: at least one is needed")
    used = [column for column in columns if column.key is not None]
    numeric = [column.index for column in used if column.conversion is not None]
    decimal = decimal_of(table, numeric)
    note = ("decimal commas",) if decimal is Decimal.COMMA else ()
    dated = next((c for c in used if c.key == "time" and c.conversion is None), None)
    return Fields(
        source=table.source,
        lines=table.lines,
        values={str(column.key): _values(table, column, decimal) for column in used},
        headings={str(column.key): column.heading for column in used},
        began=None if dated is None else datetime.fromisoformat(table.columns[dated.index][0]),
        notes=table.notes + note + decisions(columns),
        unread={c.heading: tuple(table.columns[c.index]) for c in columns if c.key is None and c.heading},
    )


def _values(table: Table, column: TableColumn, decimal: Decimal) -> np.ndarray:
    if column.key == "time" and column.conversion is None:
        return _seconds(table, column)
    if column.conversion is None:
        return np.array([of_cell(cell) for cell in table.columns[column.index]], dtype=str)
    return column.conversion.to_si(to_numbers(table, column.index, decimal))


def _seconds(table: Table, column: TableColumn) -> np.ndarray:
    """Dates as seconds from the first row."""
    dates = []
    for row, cell in enumerate(table.columns[column.index]):
        try:
            dates.append(datetime.fromisoformat(cell))
        except ValueError:
            wrong = f"'{cell[:40]}' is not a date like 2020-07-14T16:39:04"
            raise table.error(wrong, column.index, row) from None
    try:
        return np.array([(date - dates[0]).total_seconds() for date in dates])
    except TypeError:
        raise table.error("some dates have a time zone and some have none", column.index) from None


def decimal_of(table: Table, indices: Sequence[int]) -> Decimal:
    """What marks decimals in the given columns."""
    cells = [table.columns[i] for i in indices]
    if not any("," in "\t".join(column) for column in cells):
        return Decimal.POINT
    comma, point, both = (_first(table, indices, pattern) for pattern in (_COMMA, _POINT, _BOTH))
    if both is not None:
        text, *place = both
        raise table.error(f"'{text}' groups thousands: save the table without thousands separators", *place)
    if comma is None:
        return Decimal.POINT
    text, *place = comma
    if point is not None:
        raise table.error(
            f"'{text}' has a decimal comma, but '{point[0]}' (line {table.lines[point[2]]}) a decimal point: "
            "use the same one in all numbers",
            *place,
        )
    if all(_THOUSANDS.fullmatch(cell) for column in cells for cell in column if "," in cell):
        raise table.error(
            f"'{text}' may be a decimal comma or group thousands, and no other number decides it: "
            "write the numbers with decimal points",
            *place,
        )
    return Decimal.COMMA


def _first(table: Table, indices: Sequence[int], pattern: re.Pattern[str]) -> tuple[str, int, int] | None:
    """Text, column and row of the first cell of that form."""
    rows = enumerate(zip(*(table.columns[i] for i in indices), strict=True))
    cells = ((cell, i, row) for row, own in rows for i, cell in zip(indices, own, strict=True))
    return next((cell for cell in cells if pattern.fullmatch(cell[0])), None)


def to_numbers(table: Table, index: int, decimal: Decimal) -> Float[np.ndarray, " rows"]:
    """One column as numbers; NaN where a cell is blank or says so."""
    cells: Sequence[str] = table.columns[index]
    if decimal is Decimal.COMMA:
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        if "_" in "".join(cells):
            raise ValueError
        values = np.array([float(cell) for cell in cells], dtype=float)
    except ValueError:
        values = np.array([_number(table, index, row, cell) for row, cell in enumerate(cells)], dtype=float)
    if (beyond := np.abs(values) > MAX_NUMBER).any():
        row = int(np.argmax(beyond))
        what = "infinite" if np.isinf(values[row]) else "no measured value"
        text = table.columns[index][row][:40]
        raise table.error(f"'{text}' is {what}: correct it, or leave the cell blank", index, row)
    return values


def _number(table: Table, index: int, row: int, cell: str) -> float:
    cell = cell.replace("\u2212", "-").replace("\u00a0", "").strip()
    if cell.lower() in MISSING:
        return np.nan
    try:
        if "_" not in cell:
            return float(cell)
    except ValueError:
        pass
    text = table.columns[index][row][:40]
    raise table.error(f"'{text}' is not a number: correct it, or leave the cell blank", index, row)


BASE = "robot-base"
"""The robot's base frame."""
MEASURING = "measuring"
"""The frame that the base of a robot file stands in."""


def in_base(fields: Fields, *, usual: str = MEASURING) -> bool:
    """Whether the poses are in the robot's base, by the column `pose_frame`.

    Measurements are in the measuring frame and trajectories in the robot's base, unless the column says so:
    a trajectory that is written with its poses can then be read as measurements too.

    Args:
        fields: Columns in SI.
        usual: What a file without the column means.
    """
    named = fields.values.get("pose_frame")
    if named is None:
        return usual == BASE
    for row, name in enumerate(named):
        if name not in (BASE, MEASURING) or name != named[0]:
            raise fields.error(
                f"pose_frame must be {BASE} or {MEASURING}, the same in all rows, got '{name}'",
                row,
                "pose_frame",
            )
    return bool(named[0] == BASE)
