"""Which rows were observed: a row with a gap in its observation is kept out, with its reason.

A row counts when one of its observations is whole: position (with orientation where the file has one), a
marker, a distance with its anchor, a touched point, a socket, an inclinometer.
"""

import numpy as np
from jaxtyping import Bool

from workbench.base.errors import FileError
from workbench.data.readers.fields import Fields

Rows = Bool[np.ndarray, " rows"]
_TRUE = {"true", "1", "1.0", "yes", "y", "x", "wahr", "ja", "j"}
_FALSE = {"", "false", "0", "0.0", "no", "n", "falsch", "nein"}


def excluded_by_file(fields: Fields) -> Rows:
    """Rows that the file itself keeps out.

    Raises:
        FileError: A cell is neither true nor false.
    """
    if "exclude" not in fields.values:
        return np.zeros(fields.rows, bool)
    words = [str(word).strip().lower() for word in fields.values["exclude"]]
    for row, word in enumerate(words):
        if word not in _TRUE | _FALSE:
            raise fields.error(f"'{word}' is neither true nor false", row, "exclude")
    return np.array([word in _TRUE for word in words], bool)


def gaps(fields: Fields, numbers: dict[str, np.ndarray]) -> list[str]:
    """Why each row can't be used: '' for rows that can.

    Args:
        fields: Columns in SI.
        numbers: Observations that hold numbers, each (rows, …), NaN where missing: 'position',
            'orientation', 'marker 1', 'distance', 'tilt 2', …
    """
    blank = {name: np.isnan(v.reshape(fields.rows, -1)) for name, v in numbers.items()}
    empty = {name: b.all(1) for name, b in blank.items()}
    whole = {name: ~b.any(1) for name, b in blank.items()}
    if "distance" in whole and "anchor" in fields.values:
        whole["distance"] &= fields.values["anchor"] != ""
    none = np.zeros(fields.rows, bool)
    torn = {name: ~whole[name] & ~empty[name] for name in blank}
    pose = [name for name in ("position", "orientation") if name in blank]
    other = np.any([none, *(whole[name] for name in blank if name not in pose)], axis=0)
    for key in ("contact", "point"):
        if key in fields.values:
            other |= fields.values[key] != ""
    gone = np.any([none, *(empty[name] for name in pose)], axis=0) & ~other
    unseen = ~other if not pose else none
    reasons = [""] * fields.rows
    for row in np.flatnonzero(np.any([gone, unseen, *torn.values()], axis=0)).tolist():
        parts = [name for name in blank if torn[name][row]]
        lost = [name for name in pose if empty[name][row]]
        if parts:
            reasons[row] = _lacks(fields, numbers, parts, row)
        else:
            reasons[row] = f"lacks its {' and '.join(lost)}" if lost else "has no observation"
    return reasons


_PARTS = {"position": ("x", "y", "z")}


def _lacks(fields: Fields, numbers: dict[str, np.ndarray], torn: list[str], row: int) -> str:
    """'lacks z', naming the cells that are blank."""
    keys: list[str] = []
    for name in torn:
        if name == "distance":
            keys.append("anchor")
        elif name == "position":
            keys += [k for k, v in zip(_PARTS[name], numbers[name][row], strict=True) if np.isnan(v)]
        else:
            keys.append(f"a part of its {name}")
    return f"lacks {', '.join(keys)}"


def need_whole_joints(fields: Fields, q: np.ndarray, excluded: Rows) -> None:
    """Raise when a row that is not kept out lacks a joint position.

    Raises:
        FileError: Names line and column.
    """
    rows, joints = np.nonzero(np.isnan(q) & ~excluded[:, None])
    if len(rows):
        raise fields.error(
            "the joint position is missing: fill it in, delete the row, or set its 'exclude' to true",
            int(rows[0]),
            f"q{joints[0] + 1}",
        )


def refuse_incomplete(fields: Fields, names: tuple[str, ...]) -> None:
    """Raise when only some columns of a triple are there.

    Raises:
        FileError: Names the columns that are missing.
    """
    lacking = [name for name in names if name not in fields.values]
    if lacking and len(lacking) < len(names):
        given = [name for name in names if name in fields.values]
        raise FileError(
            f"{', '.join(given)} without {', '.join(lacking)}: add the column(s) {', '.join(lacking)}",
            path=fields.source,
        )
