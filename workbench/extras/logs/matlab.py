"""MATLAB files of version 5 to 7: matrices and labels by the names of their variables."""

import io
import warnings
from pathlib import Path
from typing import Any, final

import numpy as np

from workbench.base.bounded_process import ChildError
from workbench.base.errors import FileError, OptionError
from workbench.base.remedy import remedy
from workbench.data.binary_tables import read_in_child, refusal
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
    """Matrices of a MATLAB file as cells of text, under headings made from the `columns` option."""
    variables = read_arrays(data, path)
    if not variables:
        raise FileError("there are no matrices in this MATLAB file", path=str(path))
    holds = ", ".join(f"{name} ({' x '.join(map(str, value.shape))})" for name, value in variables.items())
    tables = [value for value in variables.values() if value.ndim == 2 and min(value.shape) > 1]
    if naming is not None and naming.items and len(tables) == 1:  # a list names the columns of a lone matrix
        cells = [[_text(cell) for cell in column] for column in tables[0].T]
        return grid_of(headings_in_order(naming, len(cells)), cells, source=str(path))
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
    headings, columns, notes = list[str](), list[list[str]](), list[str]()
    by_joint = [p for p in naming.pairs if any(i.name.lower() in BY_JOINT for i in (p.left, *p.right))]
    for pair in [*(p for p in naming.pairs if p not in by_joint), *by_joint]:  # others tell how many rows
        if (sides := _sides(pair, variables)) is None:
            names = f"neither '{pair.left.name}' nor '{pair.right[0].name}' is in the file"
            raise OptionError(f"{path}: {names}, which contains {holds}")
        side, wanted = sides
        table, how = _one_row_each(variables[side.name], side, wanted, len(columns and columns[0]), path)
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
    return grid_of(headings, columns, source=str(path), notes=notes)


def _sides(pair: Pair, variables: dict[str, np.ndarray]) -> tuple[NamedUnit, tuple[NamedUnit, ...]] | None:
    """The item that names a matrix, and those that say what it means, with its unit."""
    side, wanted = pair.left, pair.right
    if len(pair.right) == 1 and pair.right[0].name in variables:
        side, wanted = pair.right[0], (pair.left,)
    elif pair.left.name not in variables:
        return None
    return side, tuple(i if i.unit is not None else i._replace(unit=side.unit) for i in wanted)


def _one_row_each(
    array: np.ndarray, side: NamedUnit, wanted: tuple[NamedUnit, ...], number: int, path: Path
) -> tuple[np.ndarray, str]:
    """The matrix with one measurement a row, and how it stood in the file."""
    if array.ndim == 3 and array.shape[:2] in ((3, 3), (4, 4)):  # pages of rotations or poses
        turns = np.moveaxis(array, 2, 0)[:, :3, :3].reshape(-1, 9)
        return turns if len(array) == 3 else np.hstack([array[:3, 3, :].T, turns]), "page"
    if array.ndim != 2 or array.dtype.kind not in "fiubUOS":
        raise FileError(f"'{side.name}' is not a matrix of numbers", path=str(path))
    given = [item.orientation for item in (side, *wanted) if item.orientation]
    rows, columns = array.shape
    if wanted[0].name.lower() in BY_JOINT:
        fitting = given or [how for how, size in (("row", rows), ("column", columns)) if size == number]
    else:
        count = len(_headings(wanted, 0, path))
        if not given and count == 1 and 1 in array.shape:
            return array.reshape(-1, 1), "row" if columns == 1 else "column"
        fitting = given or [how for how, size in (("row", columns), ("column", rows)) if size == count]
    if not given and len(fitting) != 1:
        raise OptionError(
            f"{path}: say whether one measurement is a row or a column of '{side.name}' "
            f"({rows} x {columns}), e.g. columns='{wanted[0].name}[rad|column]={side.name}'",
            option="columns",
            found=side.name,
        )
    return (array.T if fitting[0] == "column" else array), str(fitting[0])


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
