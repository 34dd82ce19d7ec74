"""Excel and Parquet files: their cells, read in a child process with time and memory limits.

`read_workbook` and `read_columns` are the only entry points to the third-party readers. What
is plainly broken or too large is refused before a child is begun; the rest of what a file can do ends with
the child.
"""

import io
import warnings
import zipfile
from collections.abc import Callable
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from workbench.base.bounded_process import MEBIBYTE, ChildError, in_child
from workbench.base.errors import FileError, MissingExtraError

MAX_ROWS, MAX_COLUMNS = 2**20, 1000
"""Rows are what a sheet can hold at most; no arm has so many columns."""
MAX_UNPACKING_RATIO, MIN_BYTES, MAX_BYTES = 60, 4 * MEBIBYTE, 512 * MEBIBYTE
"""How large a workbook may unpack: so many times its size, but not less and not more [bytes]."""

BASE_MEMORY = 300 * MEBIBYTE
"""What the smallest file may take to be read; larger ones a hundred times their size more [bytes]."""

Cells = tuple[list[list[str]], list[int]]
"""Cells of the rows that hold something, and the number of each row from 1."""


def read_workbook(data: bytes, path: Path) -> dict[str, Cells]:
    """Cells of each sheet by its name."""
    what, instead = "this workbook", "save it again as .xlsx, or as CSV"
    maximum = min(max(MIN_BYTES, MAX_UNPACKING_RATIO * len(data)), MAX_BYTES)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except Exception as error:  # a broken archive raises nearly anything
        raise refusal(what, type(error).__name__, instead, path) from None
    if unpacked > maximum:
        why = f"it unpacks to {unpacked / MEBIBYTE:.0f} MiB; the limit is {maximum / MEBIBYTE:.0f} MiB"
        raise refusal(what, why, "save the measurements alone, or as CSV", path)
    return read_bounded(workbook_cells, "openpyxl", data, path, what=what, instead=instead)


def read_columns(data: bytes, path: Path) -> tuple[list[str], list[list[str]]]:
    """Names of a parquet file's columns, and the cells of each."""
    what, instead = "this parquet file", "write it again, or save it as CSV"
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise MissingExtraError("reading parquet files", extra="parquet") from None
    if len(data) < 12 or not data.endswith(b"PAR1"):
        raise refusal(what, "its end is missing", instead, path)
    return read_bounded(parquet_columns, "pyarrow.parquet", data, path, what=what, instead=instead)


def read_bounded(
    function: Callable[[bytes], Any], library: str, data: bytes, path: Path, **options: Any
) -> Any:
    """The function's result for these bytes from a child whose bounds grow with the file."""
    seconds, memory = 1.0 + 20.0 * len(data) / MEBIBYTE, BASE_MEMORY + 100 * len(data)
    return read_in_child(function, data, path, needs=library, seconds=seconds, memory=memory, **options)


def read_in_child(
    function: Callable[..., Any], content: Any, path: Path, *, what: str, instead: str, **bounds: Any
) -> Any:
    """The function's result from a child; what goes wrong there is a `FileError` with a remedy."""
    try:
        return in_child(function, content, **bounds)
    except ChildError as error:
        raise refusal(what, str(error), instead, path) from None


def refusal(what: str, why: str, instead: str, path: Path) -> FileError:
    return FileError(f"{what} can't be read ({why}): {instead}", path=str(path))


def workbook_cells(data: bytes) -> dict[str, Cells]:
    """What `read_workbook` gives, in this process."""
    import openpyxl

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # styles and extensions that the reader does not need
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        return {sheet.title: _sheet_cells(sheet) for sheet in book.worksheets}


def _sheet_cells(sheet) -> Cells:
    sheet.reset_dimensions()  # some writers store a wrong size
    rows: list[list[str]] = []
    lines: list[int] = []
    for number, row in enumerate(sheet.iter_rows(values_only=True, max_row=MAX_ROWS + 1), start=1):
        if number > MAX_ROWS:
            raise ChildError(f"sheet '{sheet.title[:40]}' has more than {MAX_ROWS} rows")
        if len(row) > MAX_COLUMNS:
            raise ChildError(f"row {number} reaches beyond column {MAX_COLUMNS}")
        cells = [text_of(value) for value in row]
        if any(cells) and not next(cell for cell in cells if cell).startswith("#"):
            rows.append(cells)
            lines.append(number)
    return rows, lines


def parquet_columns(data: bytes) -> tuple[list[str], list[list[str]]]:
    """What `read_columns` gives, in this process."""
    from pyarrow.parquet import ParquetFile

    file = ParquetFile(io.BytesIO(data))
    if file.metadata.num_rows > MAX_ROWS * 10 or file.metadata.num_columns > MAX_COLUMNS:
        raise ChildError(f"it has {file.metadata.num_rows} rows and {file.metadata.num_columns} columns")
    table = file.read(use_threads=False)
    return list(table.column_names), [[text_of(v) for v in column.to_pylist()] for column in table.columns]


def text_of(value: Any) -> str:
    """A cell as text, numbers to full precision."""
    if value is None or value != value:  # NaN, NaT
        return ""
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime | date | time):
        return value.isoformat()
    return str(value).strip()
