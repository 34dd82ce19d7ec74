"""Checks of the columns of a table of measurements, by the shapes that their annotations say."""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, get_args, get_type_hints

import numpy as np
from jaxtyping import AbstractArray

from workbench.base.array_checks import check_rotations
from workbench.base.columns import Column, Per
from workbench.base.errors import DataError, ShapeError

ROWS, JOINTS = "rows", "n"
"""Names of dimensions in annotations."""


@cache
def _shapes(table: type) -> Mapping[str, tuple[str, ...]]:
    """Dimensions of every array of a table's annotations, by name: ("rows", "6")."""
    found = {name: next(_dimensions(hint), None) for name, hint in get_type_hints(table).items()}
    return {name: tuple(text.split()) for name, text in found.items() if text is not None}


def _dimensions(hint: Any) -> Iterator[str]:
    """Dimensions of the arrays in an annotation."""
    if isinstance(hint, type) and issubclass(hint, AbstractArray):
        yield hint.dim_str
    for part in get_args(hint):
        yield from _dimensions(part)


def checked_column(
    table: type, column: Column | None, name: str, value: Any, *, rows: int, joints: int, source: str
) -> np.ndarray:
    """A column as the array that it is meant to be, one row for each of the joint positions.

    Args:
        table: Class whose annotations say the shapes of its own columns.
        column: What is known of it, if anything.
        name: Of the column.
        value: What was given.
        rows: Number of rows.
        joints: Number of joints.
        source: Where the rows come from, for messages.
    """
    if name == "exclude":
        array = _marks(value, source)
    elif name == "row":
        array = np.asarray(value)
        if array.dtype.kind not in "iu":
            raise DataError(f"{source}: 'row' must be whole numbers, one per measurement", column=name)
    elif column is not None and column.is_label:
        array = _labels(value)
    else:
        array = as_numbers(name, value, source)
    own = _shapes(table).get(name, (ROWS, JOINTS) if column and column.per is Per.JOINT else (ROWS,))
    sizes = [{ROWS: rows, JOINTS: joints}.get(d, int(d) if d.isdecimal() else None) for d in own]
    check_shape(name, array, sizes, own, source)
    if name == "rotation":
        check_rotations(array, f"{source}: orientations")
    if name == "sigma" and (array < 0.0).any():
        row = int(np.argmax((array < 0.0).any(1)))
        raise DataError(f"{source}: '{name}' is negative in row {row}", row=row, column=name)
    return array


def as_numbers(name: str, value: Any, source: str) -> np.ndarray:
    """A column of numbers."""
    try:
        return np.asarray(value, float)
    except (TypeError, ValueError):
        raise DataError(f"{source}: '{name}' must be numbers, one row per measurement", column=name) from None


def check_shape(
    name: str, array: np.ndarray, sizes: list[int | None], named: tuple[str, ...], source: str
) -> None:
    """Raise where an array has other dimensions, or another number of rows."""
    if array.ndim == len(sizes) and all(
        wanted in (None, size) for wanted, size in zip(sizes[1:], array.shape[1:], strict=True)
    ):
        if sizes[0] in (None, len(array)):
            return
        raise ShapeError(
            f"{source}: '{name}' has {len(array)} rows, the joint positions {sizes[0]}",
            expected=sizes[0],
            found=len(array),
        )
    wanted = " x ".join("joints" if d == JOINTS else d for d in named)
    got = " x ".join(map(str, array.shape)) or "a single value"
    raise ShapeError(f"{source}: '{name}' must be {wanted}, got {got}", expected=len(sizes), found=array.ndim)


def _marks(value: Any, source: str) -> np.ndarray:
    """True or False in every row, from truth values or from 0 and 1."""
    array = np.asarray(value)
    if array.dtype.kind in "iuf" and np.isin(array, (0, 1)).all():
        array = array.astype(bool)
    if array.dtype.kind != "b":
        raise DataError(f"{source}: 'exclude' must be True or False in every row", column="exclude")
    return array


def _labels(value: Any) -> np.ndarray:
    """Text in every row; empty where there is none."""
    array = np.asarray(value)
    if array.dtype.kind == "U":
        return array
    texts = ["" if v is None or v != v else str(v) for v in array.ravel().tolist()]
    return np.array(texts, dtype=str).reshape(array.shape)
