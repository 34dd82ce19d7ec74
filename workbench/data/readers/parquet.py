"""Parquet tables, through the optional library pyarrow."""

from io import BytesIO
from pathlib import Path

from workbench.base.errors import FileError, MissingExtraError
from workbench.data.readers.grid import Grid


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
    columns = [[_text(value) for value in column.to_pylist()] for column in table.columns]
    rows = [list(table.column_names), *(list(row) for row in zip(*columns, strict=True))]
    return Grid(source=str(path), rows=rows, lines=list(range(len(rows))))


def _text(value) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return repr(value)
    return value.isoformat() if hasattr(value, "isoformat") else str(value).strip()
