"""Columns in SI by their names in formats.md, from cells of text: what readers and layouts pass on."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import DataError, FileError, UnitError
from workbench.base.remedy import remedy
from workbench.base.units import parse_heading
from workbench.base.wording import listed, of_cell
from workbench.data.readers import column_meanings
from workbench.data.readers.column_meanings import TableColumn, dates_in
from workbench.data.readers.headings import CONTROLLER, is_commanded, numbers_in
from workbench.data.readers.table import Table

MISSING = re.compile(
    r"(?i)[\W_]*|nan|#?n/?a|-?1?\.?#[a-z]+[/\d]*[!?]?|null|none|missing|lost|fehlt|k\. ?a\.|invalid"
)
"""Cells without a value: blank, of signs alone, words that say so, or errors of a spreadsheet."""
NO_VALUE = (-9999.0, -99999.0, -999999.0, 99999.9, 999999.9)
"""Numbers that stand where nothing was measured."""
MAX_NUMBER = 1e50
"""Larger numbers are no measurements, and their squares no numbers."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Fields:
    """One array a column, one value a row, with the decisions taken so far.

    Args:
        lines: Line of each row in the file.
        values: Numbers in SI (NaN: missing) or labels, by the column's name in formats.md.
        headings: The file's text over each of them.
        units: The file's unit of each of them, where it is known.
        began: Date of the first row, where `time` was read from dates and counts from there.
        rotation: Orientations that a layout has already made, in place of columns; NaN where missing.
        unread: Text of columns that are left out, by the file's text over them.
        missing_units: What is wrong where units are missing that the rows may tell.
        told_twice: What is wrong where places stand there twice.
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
    missing_units: str = ""
    told_twice: str = ""

    @property
    def rows(self) -> int:
        return len(self.lines)

    @property
    def said(self) -> "Fields":
        """These columns, for those who take them as they stand; refused if the file lacks units."""
        if self.missing_units:
            raise UnitError(self.missing_units, unit="")
        return self

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
            given, lacking = ", ".join(there := [k for k in keys if k in self.values]), ", ".join(absent)
            left = ",".join(f"{parse_heading(self.headings.get(k, k)).name}=-" for k in there)
            more = remedy(f", or leave out what is there, columns='{left}' (--columns)", page="")
            more *= {*"xyz"} <= {*self.values}
            alone = "; heights alone tell too little: touch one plane, and name it in 'contact' (plane1)"
            more = alone if given == "z" else more
            not_measured = (n for n in self.unread if CONTROLLER.search(n) or is_commanded(n))
            computed = [n for n in not_measured if {*re.split(r"[\W_]+", n.lower())} & {*absent}]
            apart = f" as measured, not as in {listed(computed)}" * bool(computed)
            text = f"{given} without {lacking}: add the column(s) {lacking}{apart}{more}"
            raise FileError(text, path=self.source)
        blank = np.full(self.rows, np.nan if missing is None else missing)
        return np.stack([self.values.get(key, blank) for key in keys], axis=1)

    def take(self, rows: Int[np.ndarray, " n"]) -> "Fields":
        """The chosen rows, in the order given."""
        return replace(
            self,
            values={key: values[rows] for key, values in self.values.items()},
            rotation=None if self.rotation is None else self.rotation[rows],
            unread={name: tuple(cells[i] for i in rows) for name, cells in self.unread.items()},
            lines=tuple(self.lines[int(i)] for i in rows),
        )

    def numbers(self, pattern: str) -> list[int]:
        """Numbers of the columns whose names match a pattern with one group, such as `q(\\d+)`, in order."""
        return sorted({int(m[1]) for key in self.values if (m := re.fullmatch(pattern, key))})

    def error(self, message: str, row: int, key: str | None = None) -> FileError:
        """An error that names the row's line and the column as the file calls it."""
        column = self.headings.get(key, key) if key is not None else None
        return FileError(message, path=self.source, line=self.lines[row], column=column)


def fields_of(table: Table) -> Fields:
    """All columns of a table that are understood, in SI; units may lack that rows tell."""
    columns = column_meanings.interpret_columns(table)
    for problem in column_meanings.problems(columns):
        raise problem
    return convert(table, columns)


def convert(table: Table, columns: tuple[TableColumn, ...]) -> Fields:
    """The understood columns in SI."""
    if not table.lines:
        raise DataError(f"{table.source}: there is a header but no data row: at least one is needed")
    used = {column.key: column for column in columns if column.key is not None}
    time, began = used.get("time"), None
    signs = any("+" in table.columns[c.index] for key, c in used.items() if key.startswith("direction"))
    values = {
        key: np.array([of_cell(cell) for cell in table.columns[column.index]], dtype=str)
        if column.conversion is None
        else column.conversion.to_si(to_numbers(table, column.index, signs=signs and "direction" in key))
        for key, column in used.items()
    }
    if time is not None and time.conversion is None:
        if not (dates := dates_in(cells := table.columns[time.index])):
            row = next((k for k, cell in enumerate(cells) if not dates_in((cells[0], cell))), 0)
            wrong = f"is not a date like {cells[0]}: give all the same form, a time zone in all or in none"
            raise table.error(f"'{cells[row][:40]}' {wrong}", time.index, row)
        values["time"], began = dates[0]
    unread = {c.index: c.heading for c in columns if c.key is None and c.heading}
    return Fields(
        source=table.source,
        lines=table.lines,
        values=values,
        headings={key: column.heading for key, column in used.items()},
        units={key: column.unit for key, column in used.items() if column.unit},
        began=began,
        notes=table.notes + column_meanings.decisions(columns),
        unread={heading: tuple(table.columns[k]) for k, heading in unread.items()},
        missing_units=column_meanings.missing_units(columns),
        told_twice=column_meanings.told_twice(table, {k: c.index for k, c in used.items()}, unread),
    )


def to_numbers(table: Table, column: int | str, *, signs: bool = False) -> Float[np.ndarray, " rows"]:
    """One column, by its place or heading, as numbers; NaN where a cell is blank, or '-' that is no sign."""
    index = column if isinstance(column, int) else table.headings.index(column)
    cells = table.columns[index]
    if (signs or "+" in cells) and {*cells} <= {"+", "-", "\u2212", "0", ""}:  # signs, as of directions
        cells = tuple(f"{cell}1" if cell not in ("0", "") else cell for cell in cells)
    values = np.where(np.isin(numbers_in(cells), NO_VALUE), np.nan, numbers_in(cells))
    odd = np.flatnonzero(np.isnan(values)).tolist()
    for row in (k for k in odd if np.isnan(numbers_in(cells)[k]) and not MISSING.fullmatch(cells[k].strip())):
        text = "is not a number: write it without unit or thousands separators, or leave it blank"
        raise table.error(f"'{cells[row][:40]}' {text}", index, row)
    if (beyond := np.abs(values) > MAX_NUMBER).any():
        row = int(np.argmax(beyond))
        wrong = "is infinite or beyond any length or angle: correct it, or leave the cell blank"
        raise table.error(f"'{cells[row][:40]}' {wrong}", index, row)
    return values
