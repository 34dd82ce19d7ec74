"""The kind of a file by its first bytes: accepted, or refused with a sentence that names it."""

from enum import StrEnum
from pathlib import Path

from workbench.base import files
from workbench.base.errors import FileError


class FileKind(StrEnum):
    """The kinds of files that are read."""

    TEXT = "text table"
    EXCEL = "xlsx"
    PARQUET = "parquet"
    NPZ = "npz"


TABLE_ENDINGS = (".csv", ".tsv", ".txt", ".xlsx", ".parquet")
"""Usual endings of the names of tables."""
TABLE = "write the measurements as CSV, TSV, xlsx, parquet or MATLAB v5"
"""What to do about a file that is no table."""
POSE_PAIRS = "pairs of a robot's pose and a target's in a camera are for 'workbench handeye'"
_REFUSED: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG", "this is a PNG picture, not a table"),
    (b"\xff\xd8\xff", "this is a JPEG picture, not a table"),
    (b"GIF8", "this is a GIF picture, not a table"),
    (b"%PDF", "this is a PDF document, not a table"),
    (b"\x1f\x8b", "this is a gzip archive: unpack it first"),
    (b"7z\xbc\xaf", "this is a 7z archive: unpack it first"),
    (b"RRF", "this is a recording: open it with 'workbench review'"),
    (b"\x93NUMPY", "this is a NumPy array without column names: save it as CSV with a header line"),
    (b"\xd0\xcf\x11\xe0", "this is an old Excel file (.xls): save it as .xlsx"),
    (b"\x89HDF", "this is an HDF5 file (MATLAB's -v7.3 too): save it from MATLAB with -v7, or as CSV"),
    (b"MATLAB 7.3", "this is a MATLAB 7.3 file: save it with -v7"),
    (b"\x7fELF", "this is a program, not a table"),
)


def read_bytes(path: Path) -> bytes:
    if not files.exists(path):
        raise FileError("no such file: check the path", path=str(path))
    if path.is_dir():
        raise FileError("this is a folder: give one file with measurements", path=str(path))
    data = files.read_bytes(path, wanted="a file with measurements")
    if not data.strip(b"\xef\xbb\xbf\xff\xfe \t\r\n\0"):
        raise FileError("the file is empty: a header line and at least one row are needed", path=str(path))
    return data


def kind_of(data: bytes, path: Path) -> FileKind:
    if data.startswith(b"PK\x03\x04"):
        return _zip_kind(data, path)
    if data.startswith(b"PAR1"):
        return FileKind.PARQUET
    for magic, sentence in _REFUSED:
        if data.startswith(magic):
            raise FileError(f"{sentence}; {TABLE}" if "not a table" in sentence else sentence, path=str(path))
    return FileKind.TEXT


def _zip_kind(data: bytes, path: Path) -> FileKind:
    """An xlsx is a zip archive with a workbook in it, an npz one with arrays."""
    if b"xl/" in data and b"[Content_Types].xml" in data:
        return FileKind.EXCEL
    if b"opendocument.spreadsheet" in data[:200]:
        raise FileError("this is an OpenDocument table (.ods): save it as .xlsx or CSV", path=str(path))
    if b".npy" in data[:200]:
        return FileKind.NPZ
    raise FileError(f"this is a zip archive: unpack it first; {TABLE}", path=str(path))
