"""The meaning of each column of a table, and problems that prevent its use."""

import math
import re
from collections import Counter
from dataclasses import dataclass, replace

from workbench.base.columns import Per
from workbench.base.errors import FileError, UnitError, WorkbenchError
from workbench.base.remedy import remedy
from workbench.base.units import EXAMPLES, REMARKS, Conversion, Quantity, conversion, parse_heading
from workbench.base.wording import listed, span
from workbench.data.known_columns import known_columns
from workbench.data.readers.headings import (
    Meaning,
    is_commanded,
    known_together,
    meaning,
    normalised,
    quantities_of,
    split_ending,
)
from workbench.data.readers.table import NUMBER, Table

CHOOSE_ON_PAGE = "choose its meaning in the Measure tab, under 'Columns of the file'"
_JOINT = re.compile(r"q\d+")
_TOLD_BY_ROWS = re.compile(r"q\d+|[xyz]|roll|pitch|yaw|r[xyz]|m\d+[xyz]")
"""Columns whose unit rows of a known arm tell."""
_NUMBER = Quantity.NUMBER
TOO_LARGE = {"deg": 2.0 * math.pi, "mm": 20.0}
"""Units that are offered first where numbers are larger than the others would have them."""
_DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*")


@dataclass(frozen=True, kw_only=True)
class TableColumn:
    """One column of a table, as understood.

    Args:
        index: Place in the table, from 0.
        heading: Text of the file.
        key: Its name in formats.md; None: left out.
        unit: Unit of the file; None for labels and plain numbers.
        conversion: To SI; None for labels, dates and columns that are left out.
        remark: A decision to be said.
        problem: Why it can't be read.
        unsaid: The same of a unit that the rows may tell: until then the conversion is that of the likeliest.
    """

    index: int
    heading: str
    key: str | None = None
    unit: str | None = None
    conversion: Conversion | None = None
    remark: str | None = None
    problem: WorkbenchError | None = None
    unsaid: UnitError | None = None


def interpret_columns(table: Table) -> tuple[TableColumn, ...]:
    """What each column of a table holds; problems are kept in the columns, not raised."""
    names = [normalised(parse_heading(text).name) for text in table.headings]
    together = known_together(names)
    columns = _counted_from_one(
        [_column(table, index, together.get(name)) for index, name in enumerate(names)]
    )
    columns = [_with_unit(column, table, columns) for column in columns]
    return _without_duplicates(columns, table)


def _column(table: Table, index: int, key: str | None) -> TableColumn:
    """One column by its heading, its units row, or its unit ending ('x_mm').

    Args:
        key: What it means beside the others, if that is another thing than alone.
    """
    text = table.headings[index]
    name, unit = parse_heading(text)
    found = meaning(name) if key is None else Meaning(key, False)
    remark = None
    if found is None and unit is None and (split := split_ending(name)) is not None:
        name, unit = split
        found = meaning(name)
        remark = f"the unit of '{text}' is taken from its name"
    if found is None or is_commanded(name):
        goal = (
            f"'{text}' is a commanded value, not a measurement, and is left out"
            if is_commanded(name)
            else None
        )
        return TableColumn(index=index, heading=text, remark=goal)
    if not found.own and remark is None:
        remark = f"'{text}' is read as {found.key}"
    unit = unit if unit is not None else table.units[index] or None
    return TableColumn(index=index, heading=text, key=found.key, unit=unit, remark=remark)


def _with_unit(column: TableColumn, table: Table, columns: list[TableColumn]) -> TableColumn:
    """The column with its conversion to SI, or with the problem that it has none."""
    unit, quantities = column.unit, quantities_of(column.key) if column.key is not None else ()
    if column.key is None or not quantities:
        return replace(column, unit=None)
    where = place(table, column.heading)
    wanted = EXAMPLES[quantities[0]]
    if unit is None and wanted != EXAMPLES[_NUMBER]:
        if column.key == "time" and table.rows and _DATE.fullmatch(table.columns[column.index][0]):
            return replace(
                column, remark=f"'{column.heading}' holds dates, read as seconds from the first row"
            )
        if column.key == "time":
            remark = f"'{column.heading}' has no unit and is left out; write '{column.heading}[s]'"
            return replace(column, key=None, remark=remark)
        offered = wanted.split(" or ")
        largest = _largest(table, [c for c in columns if c.key and quantities_of(c.key) == quantities])
        too_large = (unit for unit, bound in TOO_LARGE.items() if unit in offered and largest > bound)
        first = next(too_large, offered[0])
        elsewhere = remedy(
            f"give columns='{column.key}[{first}]={column.heading}' (--columns)", page=CHOOSE_ON_PAGE
        )
        message = (
            f"{where}: the unit is missing: write '{column.heading}[{first}]' in the header "
            f"({wanted}, whichever applies), or {elsewhere}"
        )
        missing = UnitError(message, unit="")
        if not _TOLD_BY_ROWS.fullmatch(column.key):
            return replace(column, problem=missing)
        return replace(column, unit=first, conversion=conversion(first, *quantities), unsaid=missing)
    try:
        found = conversion(unit or "", *quantities)
    except UnitError as error:
        return replace(column, unit=unit, problem=UnitError(f"{where}: {error}", unit=unit or ""))
    remark = REMARKS.get(unit or "")
    remark = "; ".join(part for part in (column.remark, remark) if part) or None
    return replace(column, unit=unit, conversion=found, remark=remark)


def place(table: Table, heading: str) -> str:
    """'file, line 1, column 'q1'', as `FileError` words it."""
    line = f", line {table.heading_line}" if table.heading_line else ""
    return f"{table.source}{line}, column '{heading}'"


def _counted_from_one(columns: list[TableColumn]) -> list[TableColumn]:
    """Joints, torques and directions that a file counts from 0 (joint_0 …) are counted from 1."""
    for stem in ("q", *(c.name for c in known_columns().values() if c.per is Per.JOINT)):
        pattern = re.compile(rf"{stem}(\d+)")
        if not any(column.key == f"{stem}0" for column in columns):
            continue
        for i, column in enumerate(columns):
            if column.key is not None and (match := pattern.fullmatch(column.key)):
                key = f"{stem}{int(match[1]) + 1}"
                remark = f"'{column.heading}' is read as {key}, as the file counts joints from 0"
                columns[i] = replace(column, key=key, remark=remark)
    return columns


def _without_duplicates(columns: list[TableColumn], table: Table) -> tuple[TableColumn, ...]:
    """Columns, where two of the same meaning are each other's problem."""
    seen: dict[str, TableColumn] = {}
    for i, column in enumerate(columns):
        if column.key is None:
            continue
        if (other := seen.setdefault(column.key, column)) is not column:
            both = (
                f"the heading appears twice (columns {other.index + 1} and {column.index + 1})"
                if other.heading == column.heading
                else f"'{other.heading}' and '{column.heading}' both mean {column.key}"
            )
            message = f"{both}: remove or rename one"
            problem = FileError(message, path=table.source, line=table.heading_line, column=column.heading)
            columns[i] = replace(column, problem=problem)
    return tuple(columns)


def problems(columns: tuple[TableColumn, ...], *, rows_tell: bool) -> list[WorkbenchError]:
    """What stands against reading the columns; equal sentences about several columns are joined.

    Args:
        rows_tell: Whether units that the rows may tell are no problem.
    """
    kept = ((column, column.problem or (None if rows_tell else column.unsaid)) for column in columns)
    found = [(column, problem) for column, problem in kept if problem is not None]
    missing = [column for column, problem in found if isinstance(problem, UnitError) and not problem.unit]
    result: list[WorkbenchError] = []
    for column, problem in found:
        if column not in missing:
            result.append(problem)
        elif column is missing[0]:
            more = f" (likewise {listed([c.heading for c in missing[1:]])})" if len(missing) > 1 else ""
            result.append(UnitError(f"{problem}{more}", unit=""))
    return result


def decisions(columns: tuple[TableColumn, ...]) -> tuple[str, ...]:
    """Everything decided about the columns, in few sentences."""
    notes: list[str] = []
    renamed = [
        column
        for column in columns
        if column.remark == f"'{column.heading}' is read as {column.key}"
        and _JOINT.fullmatch(str(column.key))
    ]
    if len(renamed) > 3:
        keys, headings = [str(column.key) for column in renamed], [column.heading for column in renamed]
        notes.append(f"headings {span([repr(h) for h in headings])} are read as {span(keys)}")
    notes += [
        column.remark for column in columns if column.remark and not (len(renamed) > 3 and column in renamed)
    ]
    units: dict[tuple[str, str], list[str]] = {}
    for column in columns:
        if column.conversion is not None and column.unit:
            si = str(column.conversion.quantity)
            units.setdefault((column.unit, si), []).append(str(column.key))
    notes += [
        f"{span(keys)}: {unit} converted to {si}"
        for (unit, si), keys in units.items()
        if unit != si and si != str(_NUMBER)
    ]
    left_out = [
        column.heading
        for column in columns
        if column.key is None and column.remark is None and column.heading
    ]
    if left_out:
        notes.append(f"unknown columns are left out: {listed(left_out)}")
    nameless = sum(column.key is None and not column.heading for column in columns)
    if nameless:
        notes.append(f"{nameless} column(s) without a heading are left out")
    twice = [heading for heading, n in Counter(left_out).items() if n > 1]
    if twice:
        notes.append(f"among them {listed(twice)} more than once")
    return tuple(dict.fromkeys(notes))


def _largest(table: Table, columns: list[TableColumn]) -> float:
    """Of all numbers in some columns."""
    cells = (cell for column in columns for cell in table.columns[column.index])
    numbers = (cell.replace(",", ".") for cell in cells if NUMBER.fullmatch(cell))
    return max((abs(float(number.replace("\u2212", "-"))) for number in numbers), default=0.0)
