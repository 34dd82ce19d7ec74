"""Tables of other programs as cells of text: Excel (sheet chosen by its headings), parquet, data frames."""

import warnings
from dataclasses import replace
from datetime import date, datetime, time
from io import BytesIO
from pathlib import Path
from typing import Any

from workbench.base.errors import FileError, MissingExtraError, OptionError
from workbench.base.wording import listed
from workbench.data.readers.table import Grid, recognised_headings


def read_excel(data: bytes, path: Path, *, sheet: str | None) -> Grid:
    """Cells of the sheet that holds the measurements.

    Args:
        data: The file.
        path: For messages.
        sheet: Name of the sheet; None: the only one whose headings are measurements.

    Raises:
        FileError: No workbook, or no sheet or several sheets that look like measurements.
        OptionError: There is no sheet of that name.
    """
    grids = _sheets(data, path)
    if sheet is not None:
        if sheet not in grids:
            raise OptionError(f"{path}: there is no sheet '{sheet}': the file has {listed(list(grids))}")
        return _named(grids, sheet)
    filled = [name for name, grid in grids.items() if grid.rows]
    if not filled:
        raise FileError("all sheets are empty: a header row and rows are needed", path=str(path))
    found = [name for name in filled if recognised_headings(grids[name])]
    if len(found) > 1:
        raise FileError(
            f"the sheets {listed(found)} all look like measurements: say which, e.g. sheet='{found[0]}'",
            path=str(path),
        )
    return _named(grids, found[0] if found else filled[0])


def _named(grids: dict[str, Grid], name: str) -> Grid:
    others = len(grids) - 1
    note = f"read from sheet '{name}'" + (f"; {others} other not read" if others else "")
    return replace(grids[name], notes=(note,))


def _sheets(data: bytes, path: Path) -> dict[str, Grid]:
    import openpyxl

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # styles and extensions that the reader does not need
        try:
            book = openpyxl.load_workbook(BytesIO(data), read_only=True, data_only=True)
            return {sheet.title: _grid(sheet, path) for sheet in book.worksheets}
        except Exception as error:  # a broken workbook raises nearly anything
            raise FileError(
                f"this workbook can't be read ({type(error).__name__}): save it again as .xlsx, or as CSV",
                path=str(path),
            ) from None


def _grid(sheet, path: Path) -> Grid:
    sheet.reset_dimensions()  # some writers store a wrong size
    rows, lines = [], []
    for number, row in enumerate(sheet.iter_rows(values_only=True), start=1):
        cells = [_text(value) for value in row]
        if any(cells) and not next(cell for cell in cells if cell).startswith("#"):
            rows.append(cells)
            lines.append(number)
    return Grid(source=str(path), rows=rows, lines=lines)


def read_parquet(data: bytes, path: Path) -> Grid:
    """Columns of a parquet file as cells of text, under a row of headings.

    Raises:
        MissingExtraError: pyarrow is not installed.
        FileError: The file is broken.
    """
    try:
        from pyarrow import ArrowException
        from pyarrow.parquet import read_table
    except ImportError:
        raise MissingExtraError("reading parquet files", extra="parquet") from None
    try:
        table = read_table(BytesIO(data))
    except (ArrowException, OSError) as error:
        raise FileError(f"this parquet file can't be read ({type(error).__name__})", path=str(path)) from None
    columns = [column.to_pylist() for column in table.columns]
    return _typed_grid(list(table.column_names), columns, source=str(path))


def read_frame(frame: Any) -> Grid:
    """Columns of a pandas or polars frame, known by what they can do; neither library is needed.

    Raises:
        OptionError: this is no frame.
    """
    try:
        names = list(frame.columns)
        columns = [frame[name].to_list() for name in names]
    except (AttributeError, KeyError, TypeError):
        raise OptionError(
            f"measurements come from a file or a pandas or polars frame, not from {type(frame).__name__}"
        ) from None
    return _typed_grid([str(name) for name in names], columns, source="frame")


def _typed_grid(names: list[str], columns: list[list], *, source: str) -> Grid:
    """Columns of values as cells of text under a row of headings."""
    cells = [[_text(value) for value in column] for column in columns]
    rows = [names, *(list(row) for row in zip(*cells, strict=True))]
    return Grid(source=source, rows=rows, lines=list(range(len(rows))))


def _text(value) -> str:
    """A cell as text, numbers to full precision."""
    if value is None or value != value:  # NaN, NaT
        return ""
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return str(value).strip()
