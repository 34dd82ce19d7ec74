"""Pairs of a robot's pose and a target's pose in the camera, as hand–eye tools keep them.

Samples of easy_handeye and MoveIt (YAML or JSON), OpenCV's arrays, numbered files, or a table with both poses
in a row. Each side becomes a table that is read like one of measurements. Names tell which is which: a camera
sees one, a robot moves the other. The turn from one pose to another is as large on both sides wherever the
camera is, which tells what the numbers of orientations mean.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.base.units import parse_heading
from workbench.base.wording import listed, plural
from workbench.data.dataset import Dataset
from workbench.data.readers.arrays import TURN, arrays_in, block, table_of
from workbench.data.readers.assemble import excluded_rows
from workbench.data.readers.columns_option import IGNORED
from workbench.data.readers.fields import fields_of
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.headings import split_ending
from workbench.data.readers.orientation import read_orientation, written_orientation
from workbench.data.readers.read import read_grid
from workbench.data.readers.table import Grid, with_names
from workbench.identification.meaning.conventions import turning_alike

MAX_PAIRS = 300
"""Of two trajectories no more pairs are taken."""
SEEN = re.compile(
    r"target|marker|board|pattern|tag|object|tracking|optical|cam|sensor|chess|aruco|^c[PM]o$", re.I
)
MOVED = re.compile(r"robot|hand|gripper|effector|flange|tool|tcp|base|world|^ee$|^[rf][PM]e$", re.I)
VECTORS = re.compile(r"^[rt]vecs?$", re.I)
"""OpenCV's names of what a camera sees, where nothing else says whose they are."""
LETTERS = {"A": "robot", "B": "target", "T1": "robot", "T2": "target"}
JOINT, NO_QUATERNION = (
    re.compile(rf".*(joint|std|sigma).*|q({count})", re.I) for count in (r"\d+", r"[05-9]|\d\d+")
)
"""Names of joints and of deviations, where numbers of quaternions are none or may stand."""
_HELD = "gripper|hand|eef?|tool0?|tcp|flange|effector|target|marker|tag|object|pattern|[a-z]*board|chess"
_HOLDER = "base|world|o|robot|cam(?:era)?|sensor|optical"
_OF_IN = "[TH]_(?:{0})_(?:{1})|(?:{0})_[TH]_(?:{1})|(?:{1})(?:2|_wrt_|_(?:pose_)?in_)(?:{0})"
_ASKED = r"|(?:^|_)(?:[rf][PM]e|c[PM]o)_|^(?:target_)?(?:[xyz]|q[wxyz])(?![a-z_])"
DIRECT, INVERSE = (
    re.compile(rf"(?:^|_)(?:{_OF_IN.format(*both)})(?![a-z]){more}", re.I)
    for *both, more in ((_HOLDER, _HELD, _ASKED), (_HELD, _HOLDER, ""))
)
"""Names of hands in bases and targets in cameras, as asked for, and of the other way round."""
EASY_HANDEYE = re.compile(rb"\b(hand_world_samples|robot)[\"']?\s*:")
_LETTER, _GAP = re.compile(r"^(A|B|T1|T2)(?=_|$)"), re.compile(r"[_ ./]+")
WANTED = (
    "give the robot's and the target's pose in each row (x[m] … qw, target_x[m] … target_qw), samples of "
    "easy_handeye or MoveIt, arrays (.npz), or numbered files of both (robot_00.txt … target_00.txt …)"
)
SIDES, WIDTHS = ("robot", "target"), (1, 3, 4, 6, 7, 8, 9, 12, 16)
"""Whose poses are paired, and how many numbers a pose or a part of one has."""

Poses = Float[np.ndarray, "rows 4 4"]


def read_pairs(*paths: Path) -> tuple[Any, ...]:
    """Robot's and target's poses, the number of each pair, whether names say which way round each side's are,
    whether their writer inverts the robot's for a camera in the cell, and what was decided.

    Args:
        paths: A file or folder with both, or one with the robot's and one with the target's.
    """
    path, notes = paths[0], list[str]()
    if len(paths) > 1 and (_is_seen(paths[0].stem) or _is_seen(paths[1].stem) is False):
        paths = paths[::-1]
    content = b"" if path.is_dir() else read_bytes(path)
    try:
        named = dict(zip(SIDES, paths, strict=True)) if len(paths) > 1 else {"": path}
        found = arrays_in(named, lambda name: _is_seen(LETTERS.get(name, name)) is not None)
        arrays = _at_one_time(_of_sides(found.arrays, notes), notes)
        grid = table_of(arrays, path) if arrays else read_grid(path)
        sides = [_poses(grid, seen) for seen in (False, True)]
    except OptionError:
        raise
    except (ValueError, WorkbenchError) as error:
        why = re.split("[:;,]", str(error).split(": ", 1)[-1])[0].strip()  # then comes other files' advice
        raise FileError(f"it holds no pairs of poses ({why}); {WANTED}", path=str(path)) from None
    numbers = [np.asarray(part) for own, _ in sides for part in (own.position, own.rotation)]
    whole = np.all([np.isfinite(a.reshape(len(a), -1)).all(1) for a in numbers], axis=0)
    if not whole.any():
        raise grid.error(f"no row has both poses; {WANTED}")
    rows, poses = np.flatnonzero(whole), list[Poses]()
    lost = len(whole) - len(rows)
    notes += [*found.notes, *([f"{plural(lost, 'row')} without both poses left out"] if lost else [])]
    sides = [(own.take(rows), way) for own, way in sides]
    alike = turning_alike(sides[0][0], sides[1][0])
    for name, (own, way), (turns, how) in zip(SIDES, sides, alike, strict=True):
        pose = se3.pose(turns, np.asarray(own.position))
        poses.append(se3.inverse(pose) if way is INVERSE else pose)
        notes += [*own.notes, *([f"the {name}'s poses: {how}"] if how else [])]
    told = all(way is not None for _, way in sides)
    pair = np.array(found.numbers if len(found.numbers) == len(whole) else range(1, len(whole) + 1))
    return *poses, pair[rows], told, bool(EASY_HANDEYE.search(content)), notes


def _of_sides(arrays: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """Arrays under names that say whose poses they are; the halves of a lone one without a name."""
    if [*arrays] == [""] and (both := arrays[""]).shape[1:] in ((12,), (14,), (24,), (32,)):
        notes.append("the robot's poses are the first half of each row, the target's the second")
        both = both.reshape(-1, 6, 4) if both.shape[1] == 24 else both  # of 3 × 4 entries each
        return dict(zip(SIDES, np.hsplit(both, 2), strict=True))
    if [*arrays] == [""] and both.shape[1:] == (4, 4) and len(both) % 2 == 0:  # which turn alike
        ways = {"one after the other": np.vsplit(both, 2), "in turns": (both[::2], both[1::2])}
        how = min(ways, key=lambda k: np.ptp([_turned(side) for side in ways[k]], axis=0).sum())
        notes.append(f"robot's and target's poses stand {how}, the robot's first")
        return dict(zip(SIDES, ways[how], strict=True))
    whole = {n: own for n, own in arrays.items() if block(own)[:1].size in WIDTHS}
    named = {_LETTER.sub(lambda found: LETTERS[found[0]], name): own for name, own in whole.items()}
    unknown = [name for name, own in named.items() if len(own) > 2]
    if unknown and {*map(_is_seen, named)} == {None}:
        text = f"nothing tells whether {listed(unknown)} are the robot's or the target's"
        raise OptionError(f"{text}: give a file or folder of each, the robot's first", option="pairs")
    return named


def _turned(poses: Poses) -> Float[np.ndarray, " rows"]:
    """By which each pose is turned from the first [rad]."""
    turns = poses[:, :3, :3]
    return np.linalg.norm(se3.matrix_to_rotvec(turns[0].T @ turns), axis=1)


def _at_one_time(arrays: dict[str, Any], notes: list[str]) -> dict[str, Any]:
    """Of two tables of times and poses, each with a time in its first column, the poses nearest in time."""
    timed = {n: a for n, a in arrays.items() if np.ndim(a) == 2 and a.shape[1] == 8}
    if len(timed) != 2 or not all((np.diff(a[:, 0]) > 0.0).all() for a in timed.values()):
        return arrays
    (fewer, a), (more, b) = sorted(timed.items(), key=lambda item: len(item[1]))
    after = np.clip(np.searchsorted(b[:, 0], a[:, 0]), 1, len(b) - 1)
    nearest = after - (a[:, 0] - b[after - 1, 0] < b[after, 0] - a[:, 0])
    off = np.abs(b[nearest, 0] - a[:, 0])
    kept = np.flatnonzero(off <= np.median(np.diff(b[:, 0])))
    kept = kept[:: 1 + len(kept) // MAX_PAIRS]
    late = f"at most {1e3 * off[kept].max(initial=0.0):.2g} ms apart"
    notes.append(f"{len(kept)} pairs of poses at one time, {late}, of {len(a)} and {len(b)}")
    return {fewer: a[kept, 1:], more: b[nearest[kept], 1:]}


def _is_seen(name: str) -> bool | None:
    """Whether a name is of what a camera sees, or of what a robot moves; None for neither."""
    parts = _GAP.split(parse_heading(name).name)
    kinds = ((True, SEEN), (False, MOVED), (True, VECTORS))
    return next((seen for seen, kind in kinds if any(map(kind.search, parts))), None)


def _poses(grid: Grid, seen: bool) -> tuple[Dataset, re.Pattern[str] | None]:
    """One side of a table, and which way round names say that its poses are, if they do. Where none is said
    to be of one side, all others are."""
    head = max(grid.rows[:50], key=lambda row: sum(_is_seen(cell) is not None for cell in row))
    kinds = {c: _is_seen(c) for c in head}
    if len(lacking := {True, False} - {*kinds.values()}) == 1:
        kinds = {c: (True in lacking) if kind is None else kind for c, kind in kinds.items()}
    joint = JOINT if "q5" in {parse_heading(c).name for c in head} else NO_QUATERNION
    own = [c for c, kind in kinds.items() if kind is seen and not joint.fullmatch(parse_heading(c).name)]
    names = tuple(_heading(c, head) if c in own else c if c == "exclude" else IGNORED for c in head)
    fields = fields_of(replace(with_names(grid, names), headings=tuple(head)))
    position, left_out = fields.stacked(("x", "y", "z")), excluded_rows(fields)
    if position is not None:
        left_out |= ~position.any(1) & position.any()  # zeros stand where nothing was seen
        position[left_out] = np.nan
    rotation, _ = read_orientation(fields, usable=~left_out)
    if rotation is None or position is None:
        raise grid.error(f"no pose of the {SIDES[seen]} under {listed([c for c in head if c], longest=4)}")
    way = next((kind for kind in (INVERSE, DIRECT) if any(map(kind.search, own))), None)
    notes = [f"the {SIDES[seen]}'s poses are read the other way round, as named"] if way is INVERSE else []
    likely = {"deg": ("angles", "degrees"), "mm": ("lengths", "mm")} if fields.missing_units else {}
    read = (likely[unit] for unit in dict.fromkeys(fields.units.values()) if unit in likely)
    notes += (f"{what} of the {SIDES[seen]}'s poses are read as {unit}" for what, unit in read)
    more: dict[str, Any] = {"written": written_orientation(fields), "source": grid.source}
    return Dataset(np.zeros((fields.rows, 1)), position, rotation, notes=tuple(notes), **more), way


def _heading(cell: str, head: Sequence[str]) -> str:
    """What a heading says beside which pose it is of: `qx` of 'robot_rotation_x', `x[mm]` of 'tag_x_mm'."""
    name, unit = parse_heading(cell)
    name, head = _GAP.sub("_", name), [_GAP.sub("_", c) for c in head]
    *before, last = name.split("_")
    if unit is None and before and (split := split_ending(f"{before[-1]}_{last}")):
        (last, unit), before = split, before[:-1]
    stem = name.rpartition("_")[0]
    if last in ("1", "2", "3") and f"{stem}_4" not in head:
        last = "xyz"[int(last) - 1]
    if last in ("w", "x", "y", "z") and any(map(TURN.fullmatch, before)):
        last = ("q" if f"{stem}_w" in head else "r") + last
    elif last.isdigit():
        last = f"{'t' if len(last) > 1 and f'{stem}_16' not in head else 'pose'}_{last}"
    elif re.fullmatch("q[1-4]", last):
        last = f"q{'wxyz'[int(last[1]) - 1]}"
    return last if unit is None else f"{last}[{unit}]"
