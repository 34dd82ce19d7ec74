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
from workbench.data.readers.columns_option import NamedUnit, Naming, group_keys, headings_in_order
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import kind_of, read_bytes
from workbench.data.readers.headings import meaning
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.table import Grid, grid_of, with_headings

BY_JOINT = ("q", "torque", "direction")
"""Names of as many columns as there are joints."""
MATRICES = [{(3, 3)}, {(4, 4)}, {(3, 1)}, {(1, 3)}]
"""Shapes of what all cells hold that are rows."""
MAX_POINTS = 4
"""Of a posture, one below another."""


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

    def arrays(self, path: Path) -> dict[str, np.ndarray]:
        """Matrices with as many columns as there are pages or cells lie on their side."""
        found = read_arrays(read_bytes(path), path)
        rows = {len(a) for a in found.values() if a.ndim == 3}
        lying = {n: a.T for n, a in found.items() if a.ndim == 2 and {a.shape[1]} == rows != {len(a)}}
        return found | lying


def read_matlab(data: bytes, path: Path, *, naming: Naming | None) -> Grid:
    """Matrices of a MATLAB file as cells of text: by the `columns` option, else by their own names."""
    variables = read_arrays(data, path)
    if not variables:
        text = "there are no matrices in this MATLAB file: save tables with table2array"
        raise FileError(text, path=str(path))
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
        text = f"{path}: a MATLAB file doesn't state what its matrices are; it holds {holds}"
        how = "write e.g. columns='q[rad|column]=Q,xyz[mm|column]=P' (--columns), 'column' where one "
        how += "measurement is a column; of a lone matrix a list, 'q[rad],-,xyz[mm]'"
        elsewhere = "give it to 'workbench identify --columns', or load a CSV here"
        raise OptionError(f"{text}: {remedy(how, page=elsewhere)}", option="columns")
    columns, notes, rows = dict[str, list[str]](), list[str](), 0
    pairs = sorted(naming.pairs, key=lambda p: any(i.name.lower() in BY_JOINT for i in (p[0], *p[1])))
    for side, wanted in pairs:  # joints last: the others tell how many rows
        if len(wanted) == 1 and wanted[0].name in variables:
            side, wanted = wanted[0], (side,)
        elif side.name not in variables:
            names = f"neither '{side.name}' nor '{wanted[0].name}' is in the file"
            raise OptionError(f"{path}: {names}, which contains {holds}")
        keyed = _named(side, wanted, path)
        how, table = _one_row_each(variables[side.name], side, wanted, len(keyed), rows, path)
        if not keyed and rows % len(table) == 0 < rows - len(table):  # points of each posture in turn
            points = rows // len(table)
            columns["point"] = [str(k % points + 1) for k in range(rows)]
            table = np.repeat(table, points, axis=0)
        item, rows = wanted[0]._replace(unit=wanted[0].unit or side.unit), len(table)
        keyed = keyed or [(item, f"{item.name.lower()}{k + 1}") for k in range(table.shape[1])]
        heads = [item.heading(key) for item, key in keyed]
        columns |= {head: list(map(_text, cells)) for head, cells in zip(heads, table.T, strict=True)}
        notes.append(f"'{side.name}' is read as {heads[0]} … {heads[-1]}, one measurement per {how}")
    return grid_of(list(columns), columns.values(), source=str(path), notes=notes)


def _named(side: NamedUnit, wanted: tuple[NamedUnit, ...], path: Path) -> list[tuple[NamedUnit, str]]:
    """A matrix's columns, of which item each is; none where it has as many as there are joints."""
    if wanted[0].name.lower() in BY_JOINT:
        return []
    if unknown := next((i.name for i in wanted if not group_keys(i.name) and meaning(i.name) is None), ""):
        raise OptionError(f"{path}: '{unknown}' is not a known column: write q, xyz, quat, rpy, x, time, …")
    items = (item._replace(unit=item.unit or side.unit) for item in wanted)
    return [(item, key) for item in items for key in group_keys(item.name) or (item.name,)]


def _one_row_each(
    array: np.ndarray, side: NamedUnit, wanted: tuple[NamedUnit, ...], width: int, rows: int, path: Path
) -> tuple[str, np.ndarray]:
    """How measurements stand in a matrix, and the matrix with one a row; 0: width, or rows, are not known."""
    if array.ndim == 3 and array.shape[1:] in ((3, 3), (4, 4)):  # pages of rotations or poses
        turns = array[:, :3, :3].reshape(-1, 9)
        return "page", turns if array.shape[1] == 3 else np.hstack([array[:, :3, 3], turns])
    if array.ndim != 2 or array.dtype.kind not in "fiubUOS":
        raise FileError(f"'{side.name}' is not a matrix of numbers", path=str(path))
    if width > 1 == min(array.shape) and array.size % width == 0:
        return f"{width} numbers of the vector", array.reshape(-1, width)
    said = next((item.orientation for item in (side, *wanted) if item.orientation), None)
    ways = {how: a for how, a in (("row", array), ("column", array.T)) if said in (None, how)}
    fit = [(how, a) for how, a in ways.items() if a.shape == (rows or len(a), width or a.shape[1])]
    several = (each for each in ways.items() if not width and not rows % len(each[1]))
    fit = fit or [(how, a) for how, a in several if rows <= MAX_POINTS * len(a)]
    shape = " x ".join(map(str, array.shape))
    if said is None and len(fit) != 1:
        asked = f"say whether one measurement is a row or a column of '{side.name}' ({shape})"
        example = f"e.g. columns='{wanted[0].name}[rad|column]={side.name}'"
        raise OptionError(f"{path}: {asked}, {example}", option="columns", found=side.name)
    if not fit:
        table = ways[said or "row"]
        has = f"'{side.name}' has {len(table)} measurements of {table.shape[1]} values"
        text = f"{has} where {rows or len(table)} of {width or 'each joint'} are named"
        how = "change 'row' to 'column' or name them all"
        raise OptionError(f"{path}: {text}: {how}", option="columns", found=table.shape)
    return fit[0]


def _text(value) -> str:
    """A number to full precision, or the text of a cell."""
    if isinstance(value, np.ndarray):
        return _text(value.flat[0]) if value.size == 1 else ""
    return repr(float(value)) if isinstance(value, np.number | float | int) else str(value).strip()


def read_arrays(data: bytes, path: Path) -> dict[str, np.ndarray]:
    """Arrays of a MATLAB file by name, fields of structs as 'struct.field', pages first, from a child."""
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
    if type(value) is np.ndarray and value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _collect(f"{name}.{field}", value.flat[0][field], found)
    elif type(value) is np.ndarray and value.dtype.kind == "O" and {*map(np.shape, value.flat)} in MATRICES:
        found[name] = np.stack([*value.flat])
    elif type(value) is np.ndarray:
        found[name] = np.moveaxis(value, -1, 0) if {value.shape[:2]} in MATRICES and value.ndim > 2 else value
