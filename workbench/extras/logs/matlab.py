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

_LABELS = ("U", "O", "S")


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
    if naming is None or not naming.pairs:
        raise OptionError(
            f"{path}: a MATLAB file doesn't state what its matrices are; it holds {_contents(variables)}: "
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
    for pair in naming.pairs:
        name, side, wanted = _file_side(pair, variables, path)
        table, how = _one_row_each(variables[name], name, side, wanted, path)
        keys = _headings(wanted, table.shape[1], name, path)
        headings += keys
        columns += [[_text(value) for value in column] for column in table.T]
        notes.append(f"'{name}' is read as {keys[0]} … {keys[-1]}, one measurement per {how}")
    _same_length(columns, headings, path)
    rows = [headings, *(list(row) for row in zip(*columns, strict=True))]
    return Grid(source=str(path), rows=rows, lines=list(range(len(rows))), notes=tuple(notes))


def _contents(variables: dict[str, np.ndarray]) -> str:
    """'Q (7 x 20), P (3 x 20)'."""
    return ", ".join(f"{name} ({' x '.join(map(str, value.shape))})" for name, value in variables.items())


def _file_side(
    pair: Pair, variables: dict[str, np.ndarray], path: Path
) -> tuple[str, NamedUnit, tuple[NamedUnit, ...]]:
    """The name in the file, the item that carries it, and what it means."""
    if len(pair.right) == 1 and pair.right[0].name in variables:
        side, item = pair.right[0], pair.left
        return side.name, side, (replace(item, unit=side.unit) if item.unit is None else item,)
    if pair.left.name in variables:
        wanted = (replace(i, unit=pair.left.unit) if i.unit is None else i for i in pair.right)
        return pair.left.name, pair.left, tuple(wanted)
    raise OptionError(
        f"{path}: neither '{pair.left.name}' nor '{pair.right[0].name}' is in the file, "
        f"which contains {_contents(variables)}"
    )


def _one_row_each(
    array: np.ndarray, name: str, side: NamedUnit, wanted: tuple[NamedUnit, ...], path: Path
) -> tuple[np.ndarray, str]:
    """The matrix with one measurement a row, and how it stood in the file."""
    if array.ndim == 3 and array.shape[:2] in ((3, 3), (4, 4)):
        return _from_stack(array), "page"
    if array.ndim != 2 or array.dtype.kind not in "fiub" + "".join(_LABELS):
        raise FileError(f"'{name}' is not a matrix of numbers", path=str(path))
    orientation = side.orientation or next((item.orientation for item in wanted if item.orientation), None)
    if orientation is None and 1 in array.shape and _count(wanted) == 1:
        return array.reshape(-1, 1), "row" if array.shape[1] == 1 else "column"
    if orientation is None and (count := _count(wanted)) is not None and array.shape[0] != array.shape[1]:
        if array.shape[1] == count:
            orientation = "row"
        elif array.shape[0] == count:
            orientation = "column"
    if orientation is None:
        raise OptionError(
            f"{path}: say whether one measurement is a row or a column of '{name}' "
            f"({array.shape[0]} x {array.shape[1]}), e.g. columns='{wanted[0].name}[rad|column]={name}'",
            option="columns",
            found=name,
        )
    return (array.T if orientation == "column" else array), orientation


def _from_stack(array: np.ndarray) -> np.ndarray:
    """Rows x, y, z, r11 … r33 (or r11 … r33) from pages of 4x4 or 3x3 matrices."""
    rotation = np.moveaxis(array, 2, 0)[:, :3, :3].reshape(-1, 9)
    return rotation if array.shape[0] == 3 else np.hstack([array[:3, 3, :].T, rotation])


def _keys(wanted: tuple[NamedUnit, ...]) -> tuple[str, ...] | None:
    """Keys that the items name; None when the number of joints is open."""
    keys: list[str] = []
    for item in wanted:
        if item.name.lower() in ("q", "torque", "direction"):
            return None
        keys += group_keys(item.name) or (item.name,)
    return tuple(keys)


def _count(wanted: tuple[NamedUnit, ...]) -> int | None:
    keys = _keys(wanted)
    return len(keys) if keys is not None else None


def _headings(wanted: tuple[NamedUnit, ...], width: int, name: str, path: Path) -> list[str]:
    """Headings of the matrix's columns, with the unit of the item."""
    headings: list[str] = []
    for item in wanted:
        many = item.name.lower() in ("q", "torque", "direction")
        keys = [f"{item.name.lower()}{i}" for i in range(1, width + 1)] if many else group_keys(item.name)
        if keys is None and meaning(item.name) is None:
            raise OptionError(
                f"{path}: '{item.name}' is not a known column: write q, xyz, quat, rpy, x, time, …"
            )
        for key in keys or (item.name,):
            plain = re.fullmatch(r"r\d\d|q[wxyz]|direction\d+", key)
            headings.append(key if plain else item.heading(key))
    if len(headings) != width:
        raise OptionError(
            f"{path}: '{name}' has {width} values per measurement but {len(headings)} are named: "
            "change 'row' to 'column' or name them all",
            option="columns",
            found=width,
        )
    return headings


def _same_length(columns: list[list[str]], headings: list[str], path: Path) -> None:
    for heading, column in zip(headings, columns, strict=True):
        if len(column) != len(columns[0]):
            raise FileError(
                f"'{heading}' has {len(column)} measurements but '{headings[0]}' has {len(columns[0])}: "
                "check 'row' and 'column'",
                path=str(path),
            )


def _text(value) -> str:
    """A number to full precision, or the text of a cell."""
    if isinstance(value, np.ndarray):
        return _text(value.flat[0]) if value.size == 1 else ""
    return repr(float(value)) if isinstance(value, np.number | float | int) else str(value).strip()
