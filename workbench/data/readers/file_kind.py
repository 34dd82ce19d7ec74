"""The kind of a file by its first bytes: accepted, or refused with a sentence that names it."""

import re
from enum import Enum
from pathlib import Path

from workbench.base import files
from workbench.base.errors import FileError
from workbench.base.remedy import remedy

FileKind = Enum("FileKind", "TEXT EXCEL PARQUET ARRAYS")
"""The kinds of files that are read."""
TABLE_ENDINGS = (".csv", ".tsv", ".txt", ".xlsx", ".parquet", ".json", ".npz", ".npy")
"""Usual endings of the names of tables."""
TABLE = "write the table as CSV, TSV, xlsx, parquet or MATLAB v5"
"""What to do about a file that is no table."""
ONE_TABLE = "put rows of several into one table, with a column 'session' that says of which"
"""What to do about several tables."""
POSE_PAIRS = "pairs of a robot's pose and a target's in a camera are for 'workbench handeye'"
PROGRAM = (
    rb"(?ims).*?(?:^\s*(?:def \w+\(|(?:PROC|MODULE|PROGRAM|[JL]MOVE|PTP) \S|/PROG\b|/JOB\b|\.PROGRAM\b)"
    rb"|^\s*&ACCESS|\bmove?[jlcp] ?\(|^\s*\d+ ?: *[JLC] +P\[)"
)
"""How programs of robots begin, and how they move."""
PROGRAMS = "a robot's program; of programs RAPID, KRL and URScript are read by 'compensate'"
_ARRAYS = (
    rb"(?s)PK\x03\x04.{,200}\.npy|\x93NUMPY|\x80[\2-\5]|(\xef\xbb\xbf)?\s*(\{|\[\s*\{)|%YAML|- \w+: *[\[{]|"
    rb".*<opencv_storage|\s*(---\s*)?(- *\r?\n? *)?([A-Za-z_]\w*|[\"']?\w+[\"']):( +[\"']{2})?\r?\n"
)
"""How arrays begin, of NumPy, JSON, YAML and OpenCV."""
_REFUSED = (
    (
        rb"\x89PNG|\xff\xd8|GIF8|%PDF|PK\x03\x04|\x1f\x8b|7z\xbc|\xd0\xcf\x11\xe0|\x89HDF|MATLAB 7\.3|RRF",
        "a picture, a PDF, an archive, a recording, or an older or newer form of Excel or MATLAB",
    ),
    (
        rb"(Trajectories|Objects|Segments|Joints|Model Outputs)[,;\t ]*\r?\n\d|NO_OF_\w+[,;\t ]",
        "an export of Vicon or Qualisys: keep one row a pose, under x[mm], y[mm], z[mm], qw, qx, qy, qz of "
        "the tool's body, or under m1x[mm] … of its markers, beside the joints",
    ),
    (PROGRAM, PROGRAMS),
    (
        rb"(?ms).*?(?:^delta_theta *=|^\[DH\] *\r?$)",
        "of a UR controller, whose arms are built in: 'workbench new ur5e --apply calibration.conf --for "
        "ur-calibration' adds what is an arm's own",
    ),
    (rb"(?i)\s*<(!doctype html|html|table)", "a web page, as some programs write under the name .xls"),
    (
        rb"\s*<|(\s*#.*\n)*\s*(\[\[?[\w.\"' -]+\]\]?\s*[\r\n]|[\w-]+\s*=\s*[\"\[{\d.+-])",
        "XML or TOML, such as a robot or a plate: {robot}",
    ),
)
"""How files begin that are no tables, and what they are."""


def read_bytes(path: Path) -> bytes:
    if not files.exists(path):
        raise FileError("no such file: check the path", path=str(path))
    if path.is_dir():
        text = f"this is a folder: give one file with a table, or {ONE_TABLE}; pictures need --target FILE"
        raise FileError(text, path=str(path))
    data = files.read_bytes(path, wanted="a file with a table")
    if not data.strip(b"\xef\xbb\xbf\xff\xfe \t\r\n\0"):
        raise FileError("the file is empty: a header line and at least one row are needed", path=str(path))
    return data


def kind_of(data: bytes, path: Path) -> FileKind:
    """What a file holds.

    Raises:
        FileError: It is plainly something else than a table.
    """
    if data.startswith(b"PK\x03\x04") and b"xl/" in data and b"[Content_Types].xml" in data:
        return FileKind.EXCEL
    if data.startswith(b"PAR1"):
        return FileKind.PARQUET
    if re.match(_ARRAYS, data[:4000]):
        return FileKind.ARRAYS
    start = data[:4000].removeprefix(b"\xef\xbb\xbf")
    found = next((what for pattern, what in _REFUSED if re.match(pattern, start)), None)
    if found is not None:
        robot = remedy("give it as --robot or --plate", page="open it in the Robot tab")
        raise FileError(f"this is {found.format(robot=robot)}; {TABLE}", path=str(path))
    return FileKind.TEXT
