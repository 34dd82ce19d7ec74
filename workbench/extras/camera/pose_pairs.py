"""Pairs of a robot's pose and a target's pose in the camera, as hand–eye tools keep them.

Samples of easy_handeye and MoveIt (YAML or JSON), OpenCV's arrays in an .npz, or a table with both poses in
a row. Names tell which is which: a camera sees one, a robot moves the other. Lists of four are x, y, z, w.
"""

import re
import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.errors import FileError
from workbench.data.readers.arrays import unpacked_arrays
from workbench.data.readers.fields import fields_of
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.orientation import read_orientation
from workbench.data.readers.table import Grid, with_headings
from workbench.data.readers.text import decode, read_text

MAX_BYTES = 64 * 2**20
"""Files that unpack to more are no pairs of poses."""
SEEN = re.compile(r"target|marker|board|pattern|tag|object|tracking|optical|cam|sensor|^[rt]vecs?$|^B$", re.I)
MOVED = re.compile(r"robot|hand|gripper|effector|flange|tool|tcp|base|world|^A$", re.I)
_YAML = re.compile(r"^\W*[A-Za-z_]\w*[\"']?\s*:", re.M)
EASY_HANDEYE = re.compile(r"\b(hand_world_samples|robot)[\"']?\s*:")
_TOKEN = re.compile(r"([A-Za-z_]\w*)[\"']?\s*:|(?<![\w.])([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)(?![\w.])")
_HEADING = re.compile(r"(.*\w)[_ .]+(t?[xyz]|q[wxyz]|r[xyz]|r\d\d|roll|pitch|yaw)(\W.*)?")
PARTS = {"translation": "t", "position": "t", "rotation": "r", "orientation": "r", "quaternion": "r"}
UNITS = dict.fromkeys("xyz", "[m]") | dict.fromkeys(("rx", "ry", "rz"), "[rad]")
"""Of headings that have none, as OpenCV has them."""
WANTED = (
    "give a robot pose and the target's pose in the camera in each row: x[m], y[m], z[m], qx, qy, qz, qw, "
    "target_x[m], …, target_qw; or samples of easy_handeye or MoveIt, or an .npz of OpenCV's arrays"
)

Poses = Float[np.ndarray, "rows 4 4"]


def read_pairs(path: Path) -> tuple[Poses, Poses, bool]:
    """Robot's and target's poses, and whether their writer inverts the robot's for a camera in the cell."""
    data = read_bytes(path)
    try:
        if data.startswith(b"PK"):
            arrays = unpacked_arrays(data, MAX_BYTES)
            return _of_arrays(arrays, False), _of_arrays(arrays, True), False
        if _YAML.search(text := decode(data, path)[0]):
            inverting = bool(EASY_HANDEYE.search(text))
            return _of_samples(text, False), _of_samples(text, True), inverting
    except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise FileError(f"it holds no pairs of poses ({error}); {WANTED}", path=str(path)) from None
    grid = read_text(data, path)
    return _of_table(grid, False), _of_table(grid, True), False


def _is_seen(name: str) -> bool | None:
    """Whether a name is of what a camera sees, or of what a robot moves; None for neither."""
    return True if SEEN.search(name) else False if MOVED.search(name) else None


def _of_table(grid: Grid, seen: bool) -> Poses:
    """One side of a table; headings of the robot's may have nothing before them."""
    matches = ((row, list(map(_HEADING.fullmatch, row))) for row in grid.rows[:50])
    head, found = next((m for m in matches if any(f and _is_seen(f[1]) for f in m[1])), ([], []))
    if not head:
        raise grid.error(WANTED, 0)
    names = []
    for cell, match in zip(head, found, strict=True):
        own = match[2] + (match[3] or "") if match else cell
        own = f"r{own}" if match and match[1][-4:].lower() == "rvec" else own
        own += UNITS.get(own.removeprefix("t"), "")
        names.append(own if bool(match and _is_seen(match[1])) is seen else f"{cell} (not used)")
    rows = [names if row is head else row for row in grid.rows]
    fields = fields_of(with_headings(Grid(source=grid.source, rows=rows, lines=grid.lines)))
    rotation, _ = read_orientation(fields, usable=np.ones(fields.rows, bool))
    if rotation is None or (position := fields.stacked(("x", "y", "z"))) is None:
        raise grid.error(WANTED, 0)
    return se3.pose(rotation, position)


def _of_arrays(arrays: dict[str, np.ndarray], seen: bool) -> Poses:
    """One side of an .npz: poses, or rotations (or rotation vectors, `r…`) and places."""
    found = {}
    for name, array in arrays.items():
        if _is_seen(name) is seen:
            flat = array[..., 0] if array.shape[1:] == (3, 1) else array
            is_vector = flat.shape[1:] == (3,) and name[:1] in "rR"
            found[(3, 3) if is_vector else flat.shape[1:]] = se3.rotvec_to_matrix(flat) if is_vector else flat
    return found[4, 4] if (4, 4) in found else se3.pose(found[3, 3], found[3,])


def _of_samples(text: str, seen: bool) -> Poses:
    """One side of YAML or JSON: matrices, or places and quaternions, by the keys before their numbers."""
    found = defaultdict[str, list[float]](list)
    side, part, axis = None, "", ""
    for key, number in _TOKEN.findall(text):
        if number:
            if side is seen:
                found[part + axis].append(float(number))
        elif key in PARTS:
            part, axis = PARTS[key], ""
        elif key.removeprefix("q") in ("x", "y", "z", "w"):
            part, axis = ("r" if key[0] == "q" else part or "t"), key[-1]
        elif (named := _is_seen(key)) is not None:
            side, part, axis = named, "", ""
        elif key == "data":  # of OpenCV, behind numbers of rows and columns
            part, axis = part.strip("?"), ""
        elif key not in ("transform", "pose", "matrix"):
            part, axis = "?", ""
    if not found:
        raise ValueError(f"no number follows a key of the {'target' if seen else 'robot'}")
    if found[""]:
        return np.reshape(found[""], (-1, 4, 4))
    place = np.stack([found[f"t{a}"] for a in "xyz"], 1) if found["tx"] else np.reshape(found["t"], (-1, 3))
    turn = np.stack([found[f"r{a}"] for a in "xyzw"], 1) if found["rx"] else np.reshape(found["r"], (-1, 4))
    return se3.pose(se3.quaternion_to_matrix(turn[:, [3, 0, 1, 2]]), place)
