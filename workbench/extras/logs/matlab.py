"""MATLAB files of version 5 to 7: matrices and labels by the names of their variables."""

import io
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any, final

import numpy as np

from workbench.base.bounded_process import ChildError
from workbench.base.errors import FileError, OptionError
from workbench.base.remedy import remedy
from workbench.data.binary_tables import read_in_child, refusal
from workbench.data.readers.arrays import table_of
from workbench.data.readers.column_meanings import interpret_columns
from workbench.data.readers.columns_option import NamedUnit, Naming, Pair, group_keys, headings_in_order
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import kind_of, read_bytes
from workbench.data.readers.headings import meaning
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.table import Grid, grid_of, with_headings

BY_JOINT = ("q", "torque", "direction")
"""Names of as many columns as there are joints."""


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
    """Matrices of a MATLAB file as cells of text: by the `columns` option, else by their own names."""
    variables = read_arrays(data, path)
    if not variables:
        raise FileError("there are no matrices in this MATLAB file", path=str(path))
    holds = ", ".join(f"{name} ({' x '.join(map(str, value.shape))})" for name, value in variables.items())
    tables = [value for value in variables.values() if value.ndim == 2 and min(value.shape) > 1]
    if naming is not None and naming.items and len(tables) == 1:  # a list names the columns of a lone matrix
        cells = [list(map(_text, column)) for column in tables[0].T]
        return grid_of(headings_in_order(naming, len(cells)), cells, source=str(path))
    if naming is None:
        with suppress(FileError):
            named = {name.rpartition(".")[2]: value for name, value in variables.items()}
            found = table_of(named, path, "this is a MATLAB file")
            known = {column.key for column in interpret_columns(with_headings(found))}
            if "q1" in known and known & {"x", "m1x", "distance"}:
                return found
    if naming is None or not naming.pairs:
        raise OptionError(
            f"{path}: a MATLAB file doesn't state what its matrices are; it holds {holds}: "
            + remedy(
                "write e.g. columns='q[rad|column]=Q,xyz[mm|column]=P' (--columns), 'column' where one "
                "measurement is a column; of a lone matrix a list, 'q[rad],-,xyz[mm]'",
                page="give it to 'workbench identify --columns', or load a CSV here",
            ),
            option="columns",
        )
    columns, notes = dict[str, list[str]](), list[str]()
    for pair in sorted(naming.pairs, key=_is_by_joint):  # others tell how many rows
        side, wanted = pair
        if len(wanted) == 1 and wanted[0].name in variables:
            side, wanted = wanted[0], (side,)
        elif side.name not in variables:
            names = f"neither '{side.name}' nor '{wanted[0].name}' is in the file"
            raise OptionError(f"{path}: {names}, which contains {holds}")
        wanted = tuple(i if i.unit is not None else i._replace(unit=side.unit) for i in wanted)
        rows = len(next(iter(columns.values()), ()))
        table, how = _one_row_each(variables[side.name], side, wanted, rows, path)
        keys = _headings(wanted, table.shape[1], path)
        if table.shape[1] != len(keys) or (rows and len(table) != rows):
            raise OptionError(
                f"{path}: '{side.name}' has {len(table)} measurements of {table.shape[1]} values where "
                f"{rows or len(table)} of {len(keys)} are named: change 'row' to 'column' or name them all",
                option="columns",
                found=table.shape,
            )
        columns |= {key: list(map(_text, cells)) for key, cells in zip(keys, table.T, strict=True)}
        notes.append(f"'{side.name}' is read as {keys[0]} … {keys[-1]}, one measurement per {how}")
    return grid_of(list(columns), columns.values(), source=str(path), notes=notes)


def _is_by_joint(pair: Pair) -> bool:
    """Whether it names as many columns as there are joints."""
    return any(item.name.lower() in BY_JOINT for item in (pair[0], *pair[1]))


def _one_row_each(
    array: np.ndarray, side: NamedUnit, wanted: tuple[NamedUnit, ...], rows: int, path: Path
) -> tuple[np.ndarray, str]:
    """The matrix with one measurement a row, and how it stood in the file."""
    if array.ndim == 3 and array.shape[:2] in ((3, 3), (4, 4)):  # pages of rotations or poses
        turns = np.moveaxis(array, 2, 0)[:, :3, :3].reshape(-1, 9)
        return turns if len(array) == 3 else np.hstack([array[:3, 3, :].T, turns]), "page"
    if array.ndim != 2 or array.dtype.kind not in "fiubUOS":
        raise FileError(f"'{side.name}' is not a matrix of numbers", path=str(path))
    how = next((item.orientation for item in (side, *wanted) if item.orientation), None)
    size, width = (rows, None) if wanted[0].name.lower() in BY_JOINT else (0, len(_headings(wanted, 0, path)))
    if how is None and width == 1 and 1 in array.shape:
        return array.reshape(-1, 1), "row" if array.shape[1] == 1 else "column"
    fits = {"row": size == len(array) or width == array.shape[1]}
    fits["column"] = size == array.shape[1] or width == len(array)
    if how is None and sum(fits.values()) != 1:
        raise OptionError(
            f"{path}: say whether one measurement is a row or a column of '{side.name}' "
            f"({' x '.join(map(str, array.shape))}), e.g. columns='{wanted[0].name}[rad|column]={side.name}'",
            option="columns",
            found=side.name,
        )
    how = how or ("row" if fits["row"] else "column")
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
        headings += [item.heading(key) for key in keys or (item.name,)]
    return headings


def _text(value) -> str:
    """A number to full precision, or the text of a cell."""
    if isinstance(value, np.ndarray):
        return _text(value.flat[0]) if value.size == 1 else ""
    return repr(float(value)) if isinstance(value, np.number | float | int) else str(value).strip()


def read_arrays(data: bytes, path: Path) -> dict[str, np.ndarray]:
    """Arrays of a MATLAB file by name, fields of structs as 'struct.field', from a child."""
    what, instead = "this MATLAB file", "save it with -v7, or as CSV"
    if len(data) < 136 or 0 in data[:4] or data[124:128] not in (b"\0\1IM", b"\1\0MI"):
        raise refusal(what, "it has no header of version 5 to 7", instead, path)
    return read_in_child(matlab_arrays, data, path, needs="scipy.io", what=what, instead=instead)


def matlab_arrays(data: bytes) -> dict[str, np.ndarray]:
    """What `read_arrays` gives, in this process."""
    from scipy.io import loadmat

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            variables = loadmat(io.BytesIO(data))
        except (TypeError, ValueError, ArithmeticError, LookupError, OSError):
            raise ChildError("a variable is damaged") from None
    found: dict[str, np.ndarray] = {}
    for name, value in variables.items():
        if not name.startswith("__"):
            _collect(name, value, found)
    return found


def _collect(name: str, value: Any, found: dict[str, np.ndarray]) -> None:
    if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _collect(f"{name}.{field}", value.flat[0][field], found)
    elif type(value) is np.ndarray:
        found[name] = value
