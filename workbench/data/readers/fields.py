"""Columns in SI, by their names of formats.md: what readers and layouts hand on to be made a `Dataset`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np
from jaxtyping import Float

from workbench.base.errors import DataError, FileError
from workbench.data.readers.columns import (
    Column,
    decisions,
    problems,
    understand,
)
from workbench.data.readers.numbers import Decimal, decimal_of, to_numbers
from workbench.data.readers.table import Table


@dataclass(frozen=True, eq=False, kw_only=True)
class Fields:
    """One array a column, one value a row.

    Args:
        source: Path, for messages.
        lines: Line of each row in the file.
        values: Numbers in SI (NaN: missing) or labels, by the column's name in formats.md.
        headings: The file's text over each of them.
        units: The file's unit of each of them, where a layout knows it.
        rotation: Orientations that a layout has already made, in place of columns; NaN where missing.
        notes: Decisions taken so far.
    """

    source: str
    lines: tuple[int, ...]
    values: Mapping[str, np.ndarray]
    headings: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    rotation: Float[np.ndarray, "rows 3 3"] | None = None
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.lines)

    def error(self, message: str, row: int, key: str | None = None) -> FileError:
        """An error that names the row's line and the column as the file calls it."""
        column = self.headings.get(key, key) if key is not None else None
        return FileError(message, path=self.source, line=self.lines[row], column=column)


def fields_of(table: Table) -> Fields:
    """All columns of a table that are understood, in SI.

    Raises:
        UnitError: A unit is missing or unknown.
        FileError: A cell is no number; two columns mean the same.
        DataError: There is no data row.
    """
    columns = understand(table)
    for problem in problems(columns):
        raise problem
    return convert(table, columns)


def convert(table: Table, columns: tuple[Column, ...]) -> Fields:
    """The understood columns in SI.

    Raises:
        FileError: A cell is no number.
        DataError: There is no data row.
    """
    if not table.rows:
        raise DataError(f"{table.source}: there is a header but no data row: at least one is needed")
    used = [column for column in columns if column.key is not None]
    numeric = [column.index for column in used if column.conversion is not None]
    decimal = decimal_of(table, numeric)
    note = ("decimal commas",) if decimal is Decimal.COMMA else ()
    return Fields(
        source=table.source,
        lines=table.lines,
        values={str(column.key): _values(table, column, decimal) for column in used},
        headings={str(column.key): column.heading for column in used},
        notes=table.notes + note + decisions(columns),
    )


def _values(table: Table, column: Column, decimal: Decimal) -> np.ndarray:
    if column.key == "time" and column.conversion is None:
        return _seconds(table, column)
    if column.conversion is None:
        return np.array(table.columns[column.index], dtype=str)
    return column.conversion.to_si(to_numbers(table, column.index, decimal))


def _seconds(table: Table, column: Column) -> np.ndarray:
    """Dates as seconds from the first row.

    Raises:
        FileError: A cell is no date.
    """
    dates = []
    for line, cell in zip(table.lines, table.columns[column.index], strict=True):
        try:
            dates.append(datetime.fromisoformat(cell))
        except ValueError:
            raise FileError(
                f"'{cell[:40]}' is not a date like 2020-07-14T16:39:04",
                path=table.source,
                line=line,
                column=column.heading,
            ) from None
    try:
        return np.array([(date - dates[0]).total_seconds() for date in dates])
    except TypeError:
        raise FileError(
            "some dates have a time zone and some have none", path=table.source, column=column.heading
        ) from None
