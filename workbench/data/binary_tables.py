"""Excel and Parquet files: their cells, read in a child process with limits of time and memory.

`read_workbook` and `read_columns` are the only entry points to the third-party readers: whatever a file does
to them ends with the child.
"""

import io
import warnings
from collections.abc import Callable
from datetime import date, datetime, time
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from workbench.base.bounded_process import MEBIBYTE, ChildError, in_child
from workbench.base.errors import FileError, MissingExtraError

MAX_ROWS, MAX_COLUMNS = 2**20, 1000
"""Rows are what a sheet can hold at most; no arm has so many columns."""
BASE_MEMORY = 300 * MEBIBYTE
"""What the smallest file may take to be read; larger ones a hundred times their size more [bytes]."""

Cells = tuple[list[list[str]], list[int]]
"""Cells of the rows that hold something, and the number of each row from 1."""


@lru_cache(maxsize=1)
def read_workbook(data: bytes, path: Path) -> dict[str, Cells]:
    """Cells of each sheet by its name."""
    what, instead = "this workbook", "save the table alone as .xlsx, or as CSV"
    return read_in_child(workbook_cells, data, path, needs="openpyxl", what=what, instead=instead)


def read_columns(data: bytes, path: Path) -> tuple[list[str], list[list[str]]]:
    """Names of a parquet file's columns, and the cells of each."""
    if find_spec("pyarrow") is None:
        raise MissingExtraError("reading parquet files", extra="parquet")
    what, instead = "this parquet file", "write it again, or save it as CSV"
    return read_in_child(parquet_columns, data, path, needs="pyarrow.parquet", what=what, instead=instead)


def read_in_child(
    function: Callable[..., Any],
    content: Any,
    path: Path,
    *,
    needs: str,
    what: str,
    instead: str,
    seconds: float = 0.0,
    memory: int = 0,
) -> Any:
    """The function's result from a child; what goes wrong there is a `FileError` with a remedy.

    Args:
        function: Of the content, the file's or its path; found by its module and name.
        needs: The library that reads it.
        what: What the file is, for messages.
        instead: What to give instead.
        seconds: Time that it may take [s]; 0: by the size of the content.
        memory: Memory that it may take [bytes]; likewise.
    """
    seconds = seconds or 3.0 + 20.0 * len(content) / MEBIBYTE
    memory = memory or BASE_MEMORY + 100 * len(content)
    try:
        return in_child(function, content, needs=needs, seconds=seconds, memory=memory)
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
    rows, lines = list[list[str]](), list[int]()
    for number, row in enumerate(sheet.iter_rows(values_only=True, max_row=MAX_ROWS + 1), start=1):
        if number > MAX_ROWS:
            raise ChildError(f"sheet '{sheet.title[:40]}' has more than {MAX_ROWS} rows")
        if len(row) > MAX_COLUMNS:
            raise ChildError(f"row {number} reaches beyond column {MAX_COLUMNS}")
        cells = [text_of(value) for value in row]
        first = next(filter(None, cells), "#")
        is_head = first == "#" != "".join(cells) and not any(isinstance(v, int | float) for v in row)
        if is_head or not first.startswith("#"):  # alone it heads a column of numbers
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
