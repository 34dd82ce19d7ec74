"""Arrays as programs keep them: an .npz, or JSON of lists or of one object a row or line.

An array of rows is a column, or several: joints `q1 …`, places `x y z`, quaternions, poses and rotations by
their entries. Their units, and the order of a quaternion, are told by the rows like those of any table.
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import FileError
from workbench.base.units import parse_heading
from workbench.data.readers.blocks import arrays_in, block
from workbench.data.readers.file_kind import POSE_PAIRS, TABLE
from workbench.data.readers.headings import (
    is_commanded,
    is_of_measurement,
    known_together,
    meaning_of,
    normalised,
    quantities_of,
)
from workbench.data.readers.table import Grid, grid_of

_JOINTS = re.compile("q|joints?|joint_(?:positions|angles|states)|angles")
_PLACES = re.compile("(?:.*_)?(?:xyz|positions?|translations?|[tr]vec|points?|[pt]|tcp)")
_LIST, _ENTRY = re.compile(r"[\[(](.*)[\])]", re.DOTALL), re.compile(r"'[^']*'|\"[^\"]*\"|[^\s,;]+")
_MATRICES = {(3, 3): "r", (3, 4): "t", (4, 4): "t"}


def read_arrays(path: Path) -> Grid | None:
    """The arrays of a file, or of the numbered files of a folder, as a table; None of a folder without."""
    found = arrays_in({"": path})
    if path.is_dir() and not found.numbers:
        return None
    if [*found.arrays] == [""] and (rows := found.arrays[""]).ndim == 2:  # whose columns have no names
        return Grid(source=str(path), rows=rows.astype(str).tolist(), lines=list(range(1, len(rows) + 1)))
    grid = table_of(
        found.arrays, path, "these are arrays, or JSON" if path.is_file() else "these are numbered files"
    )
    lines = [0, *found.numbers] if len(found.numbers) == len(grid.rows) - 1 else grid.lines
    return replace(grid, lines=lines, notes=(*found.notes, *grid.notes))


def table_of(arrays: Mapping[str, Any], path: Path, what: str = "") -> Grid:
    """Arrays as long as the joints, or as most are, side by side; without `what`, under their whole names."""
    columns, left_out = dict[str, list[str]](), list[str]()
    upright = {
        str(name): own if own.ndim else np.zeros(0)
        for name, own in zip(arrays, map(block, arrays.values()), strict=True)
    }
    rows, upright = _upright(upright) if what else (max(map(len, upright.values())), upright)
    for name, array in upright.items():
        shape = array.shape[1:-1] if array.shape[2:] == (1,) else array.shape[1:]
        is_turn = shape != (3, 3) or np.abs(np.linalg.det(array) - 1.0).max() <= 0.1
        is_lens = not is_turn and (not what or ((array[:, 2] == (0, 0, 1)) & (array[:, :1, 0] > 2.0)).all())
        own = "" if shape and not what else name
        if is_lens or not (names := _headings(own, shape) if len(array) == rows else []):
            left_out.append(name)
            continue
        if not what and shape:
            names = [f"{name}_{entry.lstrip('_')}" for entry in names]
        if twice := columns.keys() & set(names):
            text = f"{what}, of which several hold {min(twice)}: keep one of them, {name} or the other"
            raise FileError(f"{text}; {POSE_PAIRS}", path=str(path))
        flat = array.reshape(rows, len(names))
        columns |= {n: [str(v) for v in own.tolist()] for n, own in zip(names, flat.T, strict=True)}
    if what and (not rows or not any(map(meaning_of, columns))):
        text = f"{what}, but no arrays with joints and places of rows; {POSE_PAIRS}; {TABLE}"
        raise FileError(text, path=str(path))
    notes = [f"left out, as not of {rows} rows: {', '.join(left_out)[:200]}"] if left_out else []
    return grid_of(list(columns), columns.values(), source=str(path), notes=notes)


def with_lists(grid: Grid) -> Grid:
    """The cells with a column for each entry of lists, as pandas writes arrays, where all are equally long.

    Labels, such as `(1, 2)` of a grid, stay; so does what has columns of its own.
    """
    head, *body = grid.rows or [[]]
    lists = dict[int, tuple[list[str], list[list[str]]]]()
    for k, name in enumerate(head):
        cells = [row[k] for row in body if len(row) == len(head)]
        found = [_ENTRY.findall(m[1]) if (m := _LIST.fullmatch(cell)) else [] for cell in cells]
        if len(sizes := {len(f) for f, cell in zip(found, cells, strict=True) if cell}) == 1 < max(sizes):
            names = _headings(name, (size := max(sizes),)) if quantities_of(meaning_of(name) or "q1") else []
            if names:
                lists[k] = names, [[e.strip("'\"[]()") for e in f] or [""] * size for f in found]
    plain = {meaning_of(name) for k, name in enumerate(head) if k not in lists} - {None}
    lists = {k: own for k, own in lists.items() if not plain & set(map(meaning_of, own[0]))}
    if not lists or len(cells) < len(body):
        return grid
    columns = [lists[k][0] if k in lists else [name] for k, name in enumerate(head)]
    rows = [[lists[k][1][i] if k in lists else [c] for k, c in enumerate(row)] for i, row in enumerate(body)]
    note = f"lists in cells are columns: {', '.join(head[k] for k in lists)}"
    flat = [[c for own in row for c in own] for row in (columns, *rows)]
    return replace(grid, rows=flat, notes=(*grid.notes, note))


def _upright(arrays: dict[str, np.ndarray]) -> tuple[int, dict[str, np.ndarray]]:
    """The number of rows, and arrays with rows first: all lie on their side where no other known one is as
    long as the joints', but one is as wide; pages of matrices anyhow."""
    turned = {n: np.moveaxis(a, -1, 0) for n, a in arrays.items() if a.ndim == 1 or len(a) != a.shape[-1]}
    long = Counter(len(a) for name, a in arrays.items() if _is_known(name, a.shape[1:]))
    wide = Counter(len(a) for name, a in turned.items() if _is_known(name, a.shape[1:]))
    rows, lie = max(long or wide, key=lambda n: (long[n], wide[n], n), default=0), not long
    joints = (a for name, a in arrays.items() if "q1" in map(meaning_of, _headings(name, a.shape[1:])[:1]))
    if (array := next(joints, None)) is not None:
        rows, width = array.shape[0], array.shape[-1]
        if lie := rows != width and long[rows] == 1 < wide[width]:
            rows = width
    return rows, arrays | {n: a for n, a in turned.items() if (lie or a.ndim > 2) and len(a) == rows}


def _is_known(name: str, shape: tuple[int, ...]) -> bool:
    """Whether columns mean something: by their names, or as the 12 or 16 entries of a pose."""
    names = [normalised(heading) for heading in _headings(name, shape)[:17]]  # more are alike
    together = known_together(dict.fromkeys(names, ()))
    return len(names) in (12, 16) or any(map(meaning_of, names)) or bool(together)


def _headings(name: str, shape: tuple[int, ...]) -> list[str]:
    """Headings of the columns of an array; none if it is no set of columns."""
    name, said = parse_heading(name)
    plain, _, ending = name.lower().rpartition("_")
    is_unit = not said and ending in ("deg", "rad", "mm", "m")
    plain, unit = (plain, f"[{ending}]") if is_unit else (name.lower(), f"[{said}]" if said else "")
    if shape in _MATRICES and not is_commanded(name):
        return [f"{_MATRICES[shape]}{i + 1}{j + 1}" for i, j in np.ndindex(shape)]
    if len(shape) != 1:
        return [name] if not shape else []
    if _JOINTS.fullmatch(plain):
        return [f"q{k + 1}{unit}" for k in range(shape[0])]
    first, _, _ = plain.partition("_" if is_of_measurement(name) else "\n")
    if shape == (3,) and any(map(_PLACES.fullmatch, (first, plain))) and not is_commanded(name):
        return [f"{'r' * ('rvec' in plain)}{axis}{unit}" for axis in "xyz"]
    if shape == (4,):
        return ["qw", "qx", "qy", "qz"]
    return [f"{name}_{k + 1}{unit if said else ''}" for k in range(shape[0])]
