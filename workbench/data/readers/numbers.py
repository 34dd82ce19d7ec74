"""From cells of text to numbers, with the line and column of whatever is none.

Whether '1,5' is a number is decided once for a file: decimal commas and decimal points in the same file, or
commas that could as well group thousands, are refused.
"""

import re
from collections.abc import Sequence
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from workbench.base.errors import FileError
from workbench.data.readers.table import Table

MISSING = frozenset({"", "nan", "na", "n/a", "#n/a", "null", "none", "-", "--", "?", "missing"})
_COMMA = re.compile(r"[-+\u2212]?(\d+,\d*|,\d+)([eE][-+]?\d+)?")
_POINT = re.compile(r"[-+\u2212]?(\d+\.\d*|\.\d+)([eE][-+]?\d+)?")
_BOTH = re.compile(r"[-+\u2212]?\d[\d.,' ]*[.,]\d+[.,]\d+([eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+\u2212]?[1-9]\d{0,2},\d{3}")


class Decimal(StrEnum):
    """What marks decimals in a file."""

    POINT = "."
    COMMA = ","


def decimal_of(table: Table, indices: Sequence[int]) -> Decimal:
    """What marks decimals in the given columns.

    Raises:
        FileError: Both marks occur, or commas may group thousands.
    """
    cells = [table.columns[i] for i in indices]
    if not any("," in "\t".join(column) for column in cells):
        return Decimal.POINT
    comma = _first(table, indices, _COMMA)
    point = _first(table, indices, _POINT)
    both = _first(table, indices, _BOTH)
    if both is not None:
        text, line, column = both
        raise FileError(
            f"'{text}' groups thousands: save the table without thousands separators",
            path=table.source,
            line=line,
            column=column,
        )
    if comma is None:
        return Decimal.POINT
    if point is not None:
        raise FileError(
            f"'{comma[0]}' has a decimal comma, but '{point[0]}' (line {point[1]}) a decimal point: "
            "write all numbers in one way",
            path=table.source,
            line=comma[1],
            column=comma[2],
        )
    marked = [cell for column in cells for cell in column if "," in cell]
    if all(_THOUSANDS.fullmatch(cell) for cell in marked):
        raise FileError(
            f"'{comma[0]}' may be a decimal comma or group thousands, and no other number decides it: "
            "write the numbers with decimal points",
            path=table.source,
            line=comma[1],
            column=comma[2],
        )
    return Decimal.COMMA


def _first(table: Table, indices: Sequence[int], pattern: re.Pattern[str]) -> tuple[str, int, str] | None:
    """Text, line and heading of the first cell of that form."""
    places = (
        (cell, table.lines[row], table.headings[i])
        for i in indices
        for row, cell in enumerate(table.columns[i])
        if pattern.fullmatch(cell)
    )
    return min(places, key=lambda found: found[1], default=None)


def to_numbers(table: Table, index: int, decimal: Decimal) -> Float[np.ndarray, " rows"]:
    """One column as numbers; NaN where a cell is blank or says so.

    Raises:
        FileError: A cell is no number, or infinite.
    """
    cells: Sequence[str] = table.columns[index]
    if decimal is Decimal.COMMA:
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        if "_" in "".join(cells):
            raise ValueError
        values = np.array([float(cell) for cell in cells], dtype=float)
    except ValueError:
        values = np.array([_number(table, index, row, cell) for row, cell in enumerate(cells)], dtype=float)
    if np.isinf(values).any():
        row = int(np.flatnonzero(np.isinf(values))[0])
        raise _error(table, index, row, "is infinite: correct it, or leave the cell blank")
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
    raise _error(table, index, row, "is not a number: correct it, or leave the cell blank")


def _error(table: Table, index: int, row: int, what: str) -> FileError:
    text = table.columns[index][row]
    return FileError(
        f"'{text[:40]}' {what}", path=table.source, line=table.lines[row], column=table.headings[index]
    )
