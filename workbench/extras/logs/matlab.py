"""MATLAB files of version 5 to 7: matrices and labels by the names of their variables."""

import re
from dataclasses import replace
from pathlib import Path
from typing import final

import numpy as np

from workbench.base.errors import FileError, OptionError
from workbench.base.remedy import remedy
from workbench.data.readers.columns_option import NamedUnit, Naming, Pair, group_keys
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import kind_of, read_bytes
from workbench.data.readers.headings import meaning
from workbench.data.readers.layouts.layout import AbstractFileLayout
from workbench.data.readers.table import Grid, with_headings
from workbench.extras.logs.binary_files import read_arrays

BY_JOINT = ("q", "torque", "direction")
"""Names of as many columns as there are joints."""
MAX_JOINTS = 9
"""A side of a matrix of joints that is longer counts measurements."""


@final
class Matlab(AbstractFileLayout):
    """Matrices of a file of version 5 to 7, named by the `columns` option."""

    name = "matlab"
    endings = (".mat",)
    is_plain = True

    def matches(self, path: Path, head: bytes) -> bool:
        is_named = path.suffix.lower() in self.endings and not head.startswith((b"PK", b"PAR1"))
        return is_named or head.startswith(b"MATLAB 5.0 MAT-file")

    def read(self, path: Path, naming: Naming | None) -> Fields:
        data = read_bytes(path)
        kind_of(data, path)  # refuses what only its name says
        return fields_of(with_headings(read_matlab(data, path, naming=naming)))


def read_matlab(data: bytes, path: Path, *, naming: Naming | None) -> Grid:
    """Matrices of a MATLAB file as cells of text, under headings made from the `columns` option."""
    variables = read_arrays(data, path)
    if not variables:
        raise FileError("there are no matrices in this MATLAB file", path=str(path))
    holds = ", ".join(f"{name} ({' x '.join(map(str, value.shape))})" for name, value in variables.items())
    if naming is None or not naming.pairs:
        raise OptionError(
            f"{path}: a MATLAB file doesn't state what its matrices are; it holds {holds}: "
            + remedy(
                "write e.g. columns='q[rad|column]=Q,xyz[mm|column]=P' (--columns), 'column' where one "
                "measurement is a column",
                page="give it to 'workbench identify --columns', or load a CSV here",
            ),
            option="columns",
        )
    headings: list[str] = []
    columns: list[list[str]] = []
    notes: list[str] = []
    all_sides = [_sides(pair, variables) for pair in naming.pairs]
    lengths = [_lengths(variables[side.name], wanted, path) for side, wanted in filter(None, all_sides)]
    common = set.intersection(*lengths) if lengths else set()
    for pair, sides in zip(naming.pairs, all_sides, strict=True):
        if sides is None:
            names = f"neither '{pair.left.name}' nor '{pair.right[0].name}' is in the file"
            raise OptionError(f"{path}: {names}, which contains {holds}")
        side, wanted = sides
        table, how = _one_row_each(variables[side.name], side, wanted, common, path)
        keys = _headings(wanted, table.shape[1], path)
        if (width := table.shape[1]) != len(keys):
            raise OptionError(
                f"{path}: '{side.name}' has {width} values per measurement but {len(keys)} are named: "
                "change 'row' to 'column' or name them all",
                option="columns",
                found=width,
            )
        if columns and len(table) != len(columns[0]):
            raise FileError(
                f"'{keys[0]}' has {len(table)} measurements but '{headings[0]}' has {len(columns[0])}: "
                "check 'row' and 'column'",
                path=str(path),
            )
        headings += keys
        columns += [[_text(cell) for cell in cells] for cells in table.T]
        notes.append(f"'{side.name}' is read as {keys[0]} … {keys[-1]}, one measurement per {how}")
    rows = [headings, *map(list, zip(*columns, strict=True))]
    return Grid(source=str(path), rows=rows, lines=list(range(len(rows))), notes=tuple(notes))


def _sides(pair: Pair, variables: dict[str, np.ndarray]) -> tuple[NamedUnit, tuple[NamedUnit, ...]] | None:
    """The item that names a matrix, and those that say what it means, with its unit."""
    wanted: tuple[NamedUnit, ...] = (pair.left,)
    if len(pair.right) == 1 and pair.right[0].name in variables:
        side = pair.right[0]
    elif pair.left.name in variables:
        side, wanted = pair.left, pair.right
    else:
        return None
    return side, tuple(replace(item, unit=side.unit) if item.unit is None else item for item in wanted)


def _is_open(wanted: tuple[NamedUnit, ...]) -> bool:
    """Whether a matrix has as many columns as there are joints."""
    return any(item.name.lower() in BY_JOINT for item in wanted)


def _lengths(array: np.ndarray, wanted: tuple[NamedUnit, ...], path: Path) -> set[int]:
    """Numbers of measurements that a matrix may hold."""
    if array.ndim != 2:
        return {array.shape[-1]}
    if _is_open(wanted):
        return {n for n in array.shape if n > MAX_JOINTS} or set(array.shape)
    count = len(_headings(wanted, 0, path))
    return {n for n, width in (array.shape, array.shape[::-1]) if width == count} or set(array.shape)


def _one_row_each(
    array: np.ndarray, side: NamedUnit, wanted: tuple[NamedUnit, ...], common: set[int], path: Path
) -> tuple[np.ndarray, str]:
    """The matrix with one measurement a row, and how it stood in the file."""
    if array.ndim == 3 and array.shape[:2] in ((3, 3), (4, 4)):  # pages of rotations or poses
        turns = np.moveaxis(array, 2, 0)[:, :3, :3].reshape(-1, 9)
        return turns if len(array) == 3 else np.hstack([array[:3, 3, :].T, turns]), "page"
    if array.ndim != 2 or array.dtype.kind not in "fiubUOS":
        raise FileError(f"'{side.name}' is not a matrix of numbers", path=str(path))
    given = [item.orientation for item in (side, *wanted) if item.orientation]
    count = -1 if _is_open(wanted) else len(_headings(wanted, 0, path))
    fitting = [how for how, size in (("row", array.shape[1]), ("column", array.shape[0])) if size == count]
    if count == -1 and len(common) == 1:
        fitting = [how for how, size in zip(("row", "column"), array.shape, strict=True) if size in common]
    if not given and count == 1 and 1 in array.shape:
        return array.reshape(-1, 1), "row" if array.shape[1] == 1 else "column"
    if not given and len(fitting) != 1:
        raise OptionError(
            f"{path}: say whether one measurement is a row or a column of '{side.name}' "
            f"({array.shape[0]} x {array.shape[1]}), e.g. columns='{wanted[0].name}[rad|column]={side.name}'",
            option="columns",
            found=side.name,
        )
    how = (given or fitting)[0]
    return (array.T if how == "column" else array), how


def _headings(wanted: tuple[NamedUnit, ...], width: int, path: Path) -> list[str]:
    """Headings of a matrix's columns, with the unit of the item."""
    headings: list[str] = []
    for item in wanted:
        name = item.name.lower()
        keys = [f"{name}{i}" for i in range(1, width + 1)] if name in BY_JOINT else group_keys(item.name)
        if keys is None and meaning(item.name) is None:
            raise OptionError(
                f"{path}: '{item.name}' is not a known column: write q, xyz, quat, rpy, x, time, …"
            )
        unitless = re.compile(r"r\d\d|q[wxyz]|direction\d+")
        headings += [key if unitless.fullmatch(key) else item.heading(key) for key in keys or (item.name,)]
    return headings


def _text(value) -> str:
    """A number to full precision, or the text of a cell."""
    if isinstance(value, np.ndarray):
        return _text(value.flat[0]) if value.size == 1 else ""
    return repr(float(value)) if isinstance(value, np.number | float | int) else str(value).strip()
