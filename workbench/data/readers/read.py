"""From a file to a `Dataset`: kind, grid, table or layout, fields, dataset; each step has its own file."""

from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.base.types import Matrix4
from workbench.base.wording import listed
from workbench.data.dataset import Dataset
from workbench.data.readers import layouts
from workbench.data.readers.arrays import read_npz
from workbench.data.readers.assemble import assemble
from workbench.data.readers.columns_option import Joints, Naming, headings_in_order, parse_columns
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import FileKind, kind_of, read_bytes
from workbench.data.readers.joint_tables import join
from workbench.data.readers.layouts.layout import AbstractFileLayout, AbstractTableLayout
from workbench.data.readers.several_tables import only_table
from workbench.data.readers.table import Grid, Table, with_headings, with_joint_names, with_names, with_pairs
from workbench.data.readers.text import read_text
from workbench.data.readers.workbooks import read_excel, read_frame, read_parquet
from workbench.parts import warn_of_broken


def read_measurements(
    source: Any,
    *,
    columns: str | Naming | None = None,
    joints: Joints = None,
    layout: str | None = None,
    sheet: str | None = None,
    base: Matrix4 | None = None,
    joint_table: str | PathLike | None = None,
    joint_columns: Naming | None = None,
) -> Dataset:
    """Measurements of a file or a data frame in SI, with every decision in `notes`.

    Args:
        source: CSV, TSV, text, xlsx, parquet or MATLAB v5 file; a folder, for a layout that takes one; or a
            pandas or polars frame whose columns have headings like those of a file (`q1[deg]`, `x[mm]` …).
        columns: What the columns are, for files whose headings do not say; see `naming`.
        joints: Number of joints of the robot, or their names in order, by which its columns may be
            called; None: as many as the file names.
        layout: Name of the file's layout; None: recognised by its headings.
        sheet: Sheet of a workbook; None: the one with headings that are known.
        base: Pose of the robot's base in the measuring frame, for files whose column `pose_frame` says that
            their poses are in the robot's base, as those of `workbench path` are.
        joint_table: File with the joints of measurements that have none of their own, such as a robot's log;
            joined by name, by an installed way such as time, or row by row.
        joint_columns: What its columns are, where its headings do not say.

    Raises:
        FileError: The file can't be read; carries line and column.
        UnitError: A unit is missing, unknown or of another quantity.
        ShapeError: The file has another number of joints.
        DataError: There are no rows, no joints, or no observation.
        OptionError: An option does not fit the file.
        MissingExtraError: An optional library is needed.
    """
    fields = read_fields(source, columns=columns, layout=layout, sheet=sheet, joints=joints, rows_tell=True)
    if joint_table is not None:
        if "q1" in fields.values:
            raise OptionError(
                f"{fields.source} already has joints; leave out the table of joints", option="joint_table"
            )
        own = read_fields(joint_table, columns=joint_columns, joints=joints, rows_tell=True)
        fields = join(fields, own)
    return assemble(fields, joints=joints, base=base)


def read_fields(
    source: Any,
    *,
    columns: str | Naming | None = None,
    layout: str | None = None,
    sheet: str | None = None,
    joints: Joints = None,
    rows_tell: bool = False,
) -> Fields:
    """All columns of a file in SI, whatever they are; options and errors as `read_measurements`.

    Args:
        rows_tell: As of `fields_of`.
    """
    found, _, table = read_by_layout(source, columns=columns, layout=layout, sheet=sheet, joints=joints)
    if found is None:
        assert table is not None, "what has no layout of its own is a table"
        return fields_of(table, rows_tell=rows_tell)
    return found


def read_by_layout(
    source: Any, *, columns: str | Naming | None, layout: str | None, sheet: str | None, joints: Joints = None
) -> tuple[Fields | None, str, Table | None]:
    """A source by its layout: the columns in SI, the layout's name, and the table if it is one.

    A plain table is left as it is: no columns, and no name.
    """
    if not isinstance(source, str | PathLike):
        for name, value in (("layout", layout), ("sheet", sheet)):
            if value is not None:
                raise OptionError(f"{name} is for files; a data frame has none", option=name, found=value)
        table = _named(read_frame(source), naming_of(columns), joints)
    else:
        path = Path(source)
        if layout not in (None, *layouts.layout_names()):
            known = listed(layouts.layout_names(), longest=100)
            raise OptionError(f"unknown layout '{layout}'; known: {known}")
        if (whole := _file_layout(path, layout)) is not None:
            if sheet is not None:
                raise _no_workbook(path, sheet)
            return whole.read(path, naming_of(columns)), whole.name, None
        table = read_table(path, columns=columns, sheet=sheet, joints=joints)
    special = _table_layout(table, columns, layout)
    return (None, "", table) if special is None else (special.read(table), special.name, table)


def naming_of(columns: str | Naming | None) -> Naming | None:
    """The `columns` option, parsed where it is text."""
    return parse_columns(columns) if isinstance(columns, str) else columns


def _file_layout(path: Path, layout: str | None) -> AbstractFileLayout | None:
    """The layout that reads this file or folder as a whole, if any."""
    if layout not in (None, layouts.PLAIN):
        known = next((known for known in layouts.file_layouts() if known.name == layout), None)
        if known is not None and not path.exists():
            raise FileError("no such file or folder: check the path", path=str(path))
        return known
    try:
        head = b""
        if path.is_file():
            with path.open("rb") as file:
                head = file.read(256)
    except OSError:
        return None
    offered = (known for known in layouts.file_layouts() if layout is None or known.is_plain)
    matching = (known for known in offered if _matches(known, path, head))
    return next(matching, None) if path.exists() else None


def _matches(known: AbstractFileLayout | AbstractTableLayout, *seen: Any) -> bool:
    """Whether a layout knows what is seen of a file; one that raises does not, and a warning names it."""
    try:
        return bool(known.matches(*seen))
    except WorkbenchError:
        raise
    except Exception as error:  # whatever is wrong with somebody else's package
        warn_of_broken(f"the layout '{known.name}'", error)
        return False


def _table_layout(
    table: Table, columns: str | Naming | None, layout: str | None
) -> AbstractTableLayout | None:
    if columns is not None and layout is None:
        return None
    for known in layouts.table_layouts():
        if layout in (None, known.name) and _matches(known, list(table.headings)):
            return known
        if layout == known.name:
            raise OptionError(
                f"{table.source}: layout '{layout}' does not fit the columns {listed(table.headings)}",
                option="layout",
                found=layout,
            )
    return None


def read_table(
    path: Path, *, columns: str | Naming | None, sheet: str | None, joints: Joints = None
) -> Table:
    """The file as named columns of text."""
    data = read_bytes(path)
    kind = kind_of(data, path)
    naming = naming_of(columns)
    if sheet is not None and kind is not FileKind.EXCEL:
        raise _no_workbook(path, sheet)
    if kind is FileKind.EXCEL:
        grid = read_excel(data, path, sheet=sheet)
    elif kind is FileKind.PARQUET:
        grid = read_parquet(data, path)
    elif kind is FileKind.NPZ:
        grid = read_npz(data, path)
    else:
        grid = read_text(data, path)
    _refuse_transform(grid)
    return _named(only_table(grid), naming, joints)


def _no_workbook(path: Path, sheet: str) -> OptionError:
    return OptionError(f"{path}: not a workbook, so it has no sheet '{sheet}': leave 'sheet' out")


def _named(grid: Grid, naming: Naming | None, joints: Joints) -> Table:
    if naming is not None and naming.items:
        return with_names(grid, headings_in_order(naming, len(grid.rows[-1])))
    if naming is not None:
        renamed = with_pairs(grid, naming)
    else:
        renamed = grid if isinstance(joints, int | None) else with_joint_names(grid, joints)
    table = with_headings(renamed)
    if renamed is grid:
        return table
    if table.heading_line not in grid.lines:
        return table
    return replace(table, own=tuple(grid.rows[grid.lines.index(table.heading_line)]))


def _refuse_transform(grid: Grid) -> None:
    """Raise for a lone 4 x 4 transform, which is easily taken for data."""
    if len(grid.rows) == 4 and all(len(row) == 4 for row in grid.rows):
        last = [cell.rstrip("0").rstrip(".,") or "0" for cell in grid.rows[3]]
        if last in (["0", "0", "0", "1"], ["-0", "0", "0", "1"]):
            raise FileError("this is a 4 x 4 transform, not a table of measurements", path=grid.source)


def read_marker_rows(path: Path | str, rows: int) -> Float[np.ndarray, "rows markers 3"]:
    """Where markers sit [m]: on the tool by design (one row), or on the base by design and as seen (two).

    The columns are those of measurements, `m1x[mm] m1y[mm] m1z[mm] …`.
    """
    fields = read_fields(path, layout="plain")
    if fields.rows != rows:
        what = "one row, the markers on the tool" if rows == 1 else "two rows, as designed and as measured"
        raise FileError(f"has {fields.rows} rows; give {what}", path=str(path))
    count = sum(f"m{k + 1}x" in fields.values for k in range(len(fields.values)))
    if count < 3:
        raise FileError(f"names {count} markers (m1x[mm] …); a frame needs three", path=str(path))
    try:
        places = [[fields.values[f"m{k + 1}{axis}"] for axis in "xyz"] for k in range(count)]
    except KeyError as missing:
        raise FileError(f"has no column {missing}; markers are counted m1, m2, …", path=str(path)) from None
    found = np.moveaxis(np.array(places, float), 2, 0)
    if not np.isfinite(found).all():
        raise FileError("has a blank cell; every marker's position is needed", path=str(path))
    return found
