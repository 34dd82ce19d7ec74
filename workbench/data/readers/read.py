"""From a file to a `Dataset`: kind, grid, table or layout, fields, dataset; each step has its own file.

A preview shows the same steps, for the user to confirm or correct.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base import files
from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.base.wording import listed
from workbench.data.binary_tables import read_columns
from workbench.data.dataset import Dataset
from workbench.data.readers import arrays, columns_option, layouts
from workbench.data.readers.assemble import assemble
from workbench.data.readers.column_meanings import TableColumn, decisions, interpret_columns, problems
from workbench.data.readers.columns_option import AS_HEADED, Columns, Joints
from workbench.data.readers.fields import Fields, convert, fields_of
from workbench.data.readers.file_kind import PROGRAM, PROGRAMS, FileKind, kind_of, read_bytes
from workbench.data.readers.headings import quantities_of
from workbench.data.readers.joint_tables import join
from workbench.data.readers.layouts import AbstractFileLayout, AbstractTableLayout
from workbench.data.readers.table import Grid, Table, grid_of, only_table, turned, with_headings, with_names
from workbench.data.readers.text import read_text
from workbench.data.readers.workbooks import read_excel, read_frame, sheets_apart
from workbench.parts import warn_of_broken

Name = str | None
"""Of a layout, or of a sheet of a workbook; None: whichever is recognised."""


@dataclass(frozen=True, kw_only=True)
class Preview:
    """What was understood of a file.

    Args:
        rows: Number of data rows; 0 when it could not be found out.
        joints: Number of joint columns.
        layout: Name of the file's layout, 'plain' for the usual one.
        decisions: What was decided, one sentence each.
        problems: What stands against reading it, one sentence each; empty when it can be read.
        dataset: What it is read as; None where something stands against it.
    """

    columns: tuple[TableColumn, ...] = ()
    rows: int = 0
    joints: int = 0
    layout: str = "plain"
    decisions: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    dataset: Dataset | None = None


def read_measurements(
    source: Any,
    *,
    columns: Columns = None,
    joints: Joints = None,
    layout: str | None = None,
    sheet: str | None = None,
    joint_table: str | PathLike | None = None,
) -> Dataset:
    """Measurements of a file or a data frame in SI, with every decision in `notes`.

    Args:
        source: CSV, TSV, text, xlsx, parquet or MATLAB v5 file; a folder, for a layout that takes one; or a
            pandas or polars frame whose columns have headings like those of a file (`q1[deg]`, `x[mm]` …).
        columns: What the columns are, for files whose headings do not say, by heading, `{"A 1": "q1[deg]"}`,
            or in order, `"q1[deg],…,-,x[mm]"`; joints of the joint table as well.
        joints: The robot, or the names of its joints in order, by which columns may be called, or their
            number; None: as many as the file names.
        layout: Name of the file's layout; None: recognised by its headings.
        sheet: Sheet of a workbook; None: the one with headings that are known.
        joint_table: File with the joints of measurements that have none of their own, such as a robot's log;
            joined by name, by an installed way such as time, or row by row.

    Raises:
        FileError: The file can't be read; carries line and column.
        UnitError: A unit is missing, unknown or of another quantity.
        ShapeError: The file has fewer joints.
        DataError: There are no rows, no joints, or no observation.
        OptionError: An option does not fit the file.
        MissingExtraError: An optional library is needed.
    """
    apart = sheets_apart(source) if sheet is columns is joint_table is None else None
    sheet, joint_sheet, joint_table = (sheet, None, joint_table) if apart is None else (*apart, source)
    naming = None if joint_table is None else columns_option.parse_columns(columns)
    joint_columns, columns = columns_option.of_joints_and_others(naming) if naming else (None, columns)
    fields = read_fields(source, columns=columns, layout=layout, sheet=sheet, joints=joints)
    if joint_table is not None:
        if "q1" in fields.values:
            text = f"{fields.source} already has joints; leave out the table of joints"
            raise OptionError(text, option="joint_table")
        more = read_fields(joint_table, columns=joint_columns, sheet=joint_sheet, joints=joints)
        fields = join(fields, more)
    return assemble(fields, joints=joints)


def preview(
    source: Any, *, columns: Columns = None, joints: Joints = None, layout: Name = None, sheet: Name = None
) -> Preview:
    """What `read_measurements` would make of a file; problems are listed, never raised."""
    found, name, fields, dataset = None, "", None, None
    understood, wrong = tuple[TableColumn, ...](), list[WorkbenchError]()
    try:
        found, name = read_by_layout(source, columns=columns, layout=layout, sheet=sheet, joints=joints)
        understood = interpret_columns(found) if isinstance(found, Table) else tuple(_by_layout(found))
        wrong = problems(understood)
        if not wrong:
            fields = convert(found, understood) if isinstance(found, Table) else found
            dataset = assemble(fields, joints=joints)
    except WorkbenchError as error:
        wrong = [error]
    held = dataset or fields or found
    return Preview(
        columns=tuple(replace(c, unit=None) if c.missing_unit else c for c in understood),
        rows=0 if found is None else len((fields or found).lines),
        joints=sum(re.fullmatch(r"q\d+", column.key or "") is not None for column in understood),
        layout=name or "plain",
        decisions=() if held is None else held.notes + decisions(understood) * isinstance(held, Table),
        problems=tuple(map(str, wrong)),
        dataset=dataset,
    )


def _by_layout(fields: Fields) -> Iterator[TableColumn]:
    """The columns that a layout has read, and those that it left out."""
    read = fields.headings
    for key in {**fields.values, **read}:
        si = "rad" if key.startswith("orient") else next(map(str, quantities_of(key)), None)
        yield TableColumn(index=-1, heading=read.get(key, key), key=key, unit=fields.units.get(key), si=si)
    yield from (TableColumn(index=-1, heading=text) for text in fields.unread if text not in read.values())


def read_fields(
    source: Any, *, columns: Columns = None, layout: Name = None, sheet: Name = None, joints: Joints = None
) -> Fields:
    """All columns of a file in SI, whatever they are; options and errors as `read_measurements`."""
    found, _ = read_by_layout(source, columns=columns, layout=layout, sheet=sheet, joints=joints)
    return fields_of(found) if isinstance(found, Table) else found


def read_by_layout(
    source: Any, *, columns: Columns, layout: Name, sheet: Name, joints: Joints = None
) -> tuple[Fields | Table, str]:
    """A source by its layout: the columns in SI and the layout's name; a plain table as it is, nameless."""
    if layout not in (None, *(names := layouts.layout_names())):
        raise OptionError(f"unknown layout '{layout}'; known: {listed(names, longest=100)}")
    if isinstance(source, str | PathLike):
        path = Path(source)
        if sheet is None and (whole := file_layout(path, layout)) is not None:
            return whole.read(path, columns_option.parse_columns(columns) or None), whole.name
    table = read_table(source, columns=columns, sheet=sheet, joints=joints)
    headings, (offered, _) = list(table.headings), layouts.layouts()
    tried = [k for k in offered if k.name == layout or (layout is None and not columns)]
    special = next((k for k in tried if _matches(k, headings)), None)
    if layout is not None and tried and special is None:
        text = f"{table.source}: layout '{layout}' does not fit the columns {listed(headings)}"
        raise OptionError(text, option="layout", found=layout)
    return (table, "") if special is None else (special.read(table), special.name)


def file_layout(path: Path, layout: str | None = None) -> AbstractFileLayout | None:
    """The layout that reads this file or folder as a whole, if any."""
    (_, offered), head = layouts.layouts(), b""
    if layout not in (None, layouts.PLAIN):
        named = next((known for known in offered if known.name == layout), None)
        if named is not None and not path.exists():
            raise FileError("no such file or folder: check the path", path=str(path))
        return named
    if not files.exists(path):
        return None
    with suppress(OSError, ValueError):  # those are said by what reads it
        if path.is_file():
            with path.open("rb") as file:
                head = file.read(256)
    plain = (known for known in offered if layout is None or known.is_plain)
    return next((known for known in plain if _matches(known, path, head)), None)


def _matches(known: AbstractFileLayout | AbstractTableLayout, *seen: Any) -> bool:
    """Whether a layout knows what is seen of a file; one that raises does not, and a warning names it."""
    try:
        return bool(known.matches(*seen))
    except WorkbenchError:
        raise
    except Exception as error:  # whatever is wrong with somebody else's package
        warn_of_broken(f"the layout '{known.name}'", error)
        return False


def read_table(
    source: Any, *, columns: Columns = AS_HEADED, sheet: Name = None, joints: Joints = None
) -> Table:
    """A file or a data frame as named columns of text."""
    naming = columns_option.parse_columns(columns)
    grid = read_grid(Path(source), sheet=sheet) if isinstance(source, str | PathLike) else read_frame(source)
    if naming and naming.items:
        return with_names(grid, columns_option.headings_in_order(naming, len(grid.rows[-1])))
    return with_headings(only_table(arrays.with_lists(turned(grid))), naming, joints)


def read_grid(path: Path, *, sheet: str | None = None) -> Grid:
    """The cells of a file."""
    if path.is_dir() and (grid := arrays.read_arrays(path)) is not None:
        return grid
    data = read_bytes(path)
    if named := arrays.arrays_of_names(data, path):
        grid = arrays.table_of(named, path, "numbers stand behind their names")
        return replace(grid, notes=(*grid.notes, PROGRAMS)) if re.match(PROGRAM, data[:4000]) else grid
    kind = kind_of(data, path)
    if kind is FileKind.EXCEL:
        return read_excel(data, path, sheet=sheet)
    if sheet is not None:
        raise OptionError(f"{path}: not a workbook, so it has no sheet '{sheet}': leave 'sheet' out")
    if kind is FileKind.ARRAYS and (grid := arrays.read_arrays(path)) is not None:
        return grid
    if kind is FileKind.PARQUET:
        return grid_of(*read_columns(data, path), source=str(path))
    grid = read_text(data, path)
    with suppress(ValueError):  # of numbers alone, which may be matrices one below another
        if (stack := arrays.upright(np.array(grid.rows, float))).ndim == 3:
            return arrays.table_of({"pose": stack}, path, "these are matrices")
    return grid
