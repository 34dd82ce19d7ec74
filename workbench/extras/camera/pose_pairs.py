"""Pairs of a robot's pose and a target's pose in the camera, as hand–eye tools keep them.

Samples of easy_handeye and MoveIt (YAML or JSON), OpenCV's arrays, numbered files, or a table with both poses
in a row. Each side becomes a table that is read like one of measurements. Names tell which is which: a camera
sees one, a robot moves the other. The turn from one pose to another is as large on both sides wherever the
camera is, which tells what the numbers of orientations mean.
"""

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base import se3
from workbench.base.errors import FileError, OptionError, WorkbenchError
from workbench.base.units import parse_heading
from workbench.base.wording import listed, plural
from workbench.data.dataset import Dataset
from workbench.data.orientations import WrittenOrientation
from workbench.data.readers.arrays import TURN, Arrays, arrays_in, block, table_of
from workbench.data.readers.assemble import excluded_rows
from workbench.data.readers.columns_option import IGNORED
from workbench.data.readers.fields import fields_of
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.orientation import read_orientation, written_orientation
from workbench.data.readers.read import read_grid
from workbench.data.readers.table import Grid, with_names
from workbench.extras.camera.pair_fit import CLEARLY
from workbench.identification.meaning.conventions import turning_alike

MAX_PAIRS = 300
"""Of two trajectories no more pairs are taken."""
SEEN = re.compile(
    r"target|marker|board|pattern|tag|object|tracking|optical|cam|sensor|chess|aruco|^c[PMTH][otw]$", re.I
)
MOVED = re.compile(
    r"robot|hand|gripper|effector|flange|tool|tcp|base|world|^ee$|^[rf][PM]e$|^b[TH][eg]$", re.I
)
VECTORS = re.compile(r"^[rt]vecs?$", re.I)
"""OpenCV's names of what a camera sees, where nothing else says whose they are."""
LETTERS = {"A": "robot", "B": "target", "T1": "robot", "T2": "target"}
LABEL = re.compile(r"(?:^|_)(?:id|image|picture|file(?:name)?|name|index|frame|sample|number|nr|no)$", re.I)
DETECTED = re.compile(r"(?:\w+_)?(?:detected|found|visible|seen|valid|success|ok)", re.I)
FALSE = ("0", "0.0", "false", "no", "n", "-1")
"""Columns that tell which rows are one pair, or whether the target was seen, and how these deny it."""
JOINT, NO_QUATERNION = (
    re.compile(rf".*(joint|std|sigma).*|q({count})", re.I) for count in (r"\d+", r"[05-9]|\d\d+")
)
"""Names of joints and of deviations, where numbers of quaternions are none or may stand."""
_HELD = "gripper|hand|eef?|tool0?|tcp|flange|effector|target|marker|tag|object|pattern|[a-z]*board|chess"
_HOLDER = "base|world|o|robot|cam(?:era)?|sensor|optical"
_OF_IN = "[TH]_(?:{0})_(?:{1})|(?:{0})_[TH]_(?:{1})|(?:{1})(?:2|_wrt_|_(?:pose_)?in_)(?:{0})"
_NAMED = r"|(?:^|_)(?:[rf][PM]e|b[TH][eg]|c[PMTH][otw])_"
DIRECT, INVERSE = (
    re.compile(rf"(?:^|_)(?:{_OF_IN.format(*both)})(?![a-z]){more}", re.I)
    for *both, more in ((_HOLDER, _HELD, _NAMED), (_HELD, _HOLDER, ""))
)
"""Names of hands in bases and targets in cameras, and of the other way round."""
EASY_HANDEYE = re.compile(rb"\b(hand_world_samples|robot)[\"']?\s*:")
ANGLES = {"alpha": "rx", "beta": "ry", "gamma": "rz"}
"""Angles of Halcon, whose order the pairs tell."""
_ADVICE = re.compile(r"[:;](?![^(]*\))")
_ENTRY = re.compile(r"(?i)(r?[xyz]|q[wxyz0-4]|[abcwpr])$")
"""An entry of a pose, behind the letter of a side."""
_LETTER, _GAP = re.compile(r"^(A|B|T1|T2)(?=_|$)"), re.compile(r"[_ ./]+|(?<=vec)(?=\d)")
WANTED = (
    "give a robot pose and a target pose in each row (x[m] … target_qw), samples of easy_handeye or MoveIt, "
    ".npz, or numbered files of both (robot_00.txt …)"
)
PICTURES = (
    "pictures are for 'workbench identify FOLDER --target target.toml --joints TABLE'; of a plain chessboard "
    "give OpenCV's rvec and tvec in each"
)
SIDES, WIDTHS = ("robot", "target"), (1, 3, 4, 6, 7, 8, 9, 12, 16)
"""Whose poses are paired, and how many numbers a pose or a part of one has."""
HALVES = {12: (6,), 14: (7,), 24: (3, 4), 32: (16,)}
"""Shapes of a pose by how many numbers two have."""
MIN_GROUP = 6
"""Columns of a pose."""
Side = tuple[Dataset, re.Pattern[str] | None]
"""Poses of one side, and which way round names say that they are, if they do."""


def read_pairs(*paths: Path) -> tuple[Any, ...]:
    """Robot's and target's poses, the number of each pair, whether names say which way round each side's are,
    whether their writer inverts the robot's for a camera in the cell, and what was decided.

    Args:
        paths: A file or folder with both, or one with the robot's and one with the target's.
    """
    if len(paths) > 1 and (_is_seen(paths[0].stem) or _is_seen(paths[1].stem) is False):
        paths = paths[::-1]
    path, notes, found = paths[0], list[str](), Arrays({})
    content, *_ = (b"" if each.is_dir() else read_bytes(each) for each in paths)
    try:
        named = dict(zip(SIDES, paths, strict=True)) if len(paths) > 1 else {"": path}
        found = arrays_in(named, lambda name: _is_seen(LETTERS.get(name, name)) is not None)
        arrays = _at_one_time(_of_sides(found.arrays, path, notes), notes)
        arrays, numbers = _of_one_label(arrays, found.numbers, notes)
        lists = {name for name, a in arrays.items() if block(a).shape[1:] == (4,)}  # x, y, z, w
        arrays |= {name: np.roll(block(arrays[name]), 1, axis=1) for name in lists}
        turned = {n: np.roll(a, 3, axis=1) for n, a in arrays.items() if np.shape(a)[1:] == (6,)}
        grid = table_of(arrays, path) if arrays else read_grid(path)
        grids = [grid, table_of(arrays | turned, path)] if turned else [grid]  # rvec, tvec of OpenCV
        ways = [[_poses(each, seen, lists, notes) for each in grids] for seen in (False, True)]
    except OptionError:
        raise
    except (ValueError, WorkbenchError) as error:
        *where, why = str(error).removeprefix(str(path)).removeprefix(", ").split(": ", 1)
        why = ": ".join([*filter(None, where), _ADVICE.split(why)[0].strip()])  # which is other files'
        wanted = PICTURES if "image" in found.arrays else WANTED
        raise FileError(f"it holds no pairs of poses ({why}); {wanted}", path=str(path)) from None
    tried = [(given, *_alike(given)) for given in product(*ways)]
    off = min(apart for _, apart, *_ in tried)
    given, _, whole, alike = next(each for each in tried if each[1] <= CLEARLY * off)
    if not whole.any():
        raise grid.error(f"no row has both poses; {WANTED}")
    poses, lost = list[np.ndarray](), int((~whole).sum())
    notes += [*found.notes, *([f"{plural(lost, 'row')} without both poses left out"] if lost else [])]
    for name, own, (data, way), (turns, how) in zip(SIDES, ways, given, alike, strict=True):
        pose = se3.pose(turns, np.asarray(data.position)[whole])
        poses.append(se3.inverse(pose) if way is INVERSE else pose)
        first = "" if data is own[0][0] else "the orientation stands before the position, as the pairs tell"
        notes += [*data.notes, *(f"the {name}'s poses: {text}" for text in (first, how) if text)]
    if np.array_equal(poses[0], poses[1]):
        raise grid.error("both sides hold the same poses: give the robot's and the target's in the camera")
    told = all(way is not None for _, way in given)
    pair = np.array(numbers if len(numbers) == len(whole) else range(1, len(whole) + 1))
    return *poses, pair[whole], told, bool(EASY_HANDEYE.search(content)), [*dict.fromkeys(notes)]


def _of_sides(arrays: dict[str, Any], path: Path, notes: list[str]) -> dict[str, Any]:
    """Arrays under names that say whose poses they are; the halves of a lone one, or of one of pairs."""
    pairs = [a for name, a in arrays.items() if not name or (a.ndim > 2 and a.shape[1] == 2)]
    is_told = any(_is_seen(name) is not None for name, a in arrays.items() if len(a) > 2)
    both = pairs[0] if len(pairs) == 1 and not is_told else np.zeros(0)
    if half := HALVES.get(both[:1].size):
        notes.append("the robot's poses are the first half of each row, the target's the second")
        halves = np.moveaxis(both.reshape(len(both), 2, *half), 1, 0)
        return dict(zip(SIDES, halves, strict=True))
    if [*arrays] == [""] and both.shape[1:] == (4, 4) and len(both) % 2 == 0:  # which turn alike
        ways = {"one after the other": np.vsplit(both, 2), "in turns": (both[::2], both[1::2])}
        turns = {k: [s[:, :3, :3] @ s[0, :3, :3].T for s in own] for k, own in ways.items()}
        how = min(ways, key=lambda k: np.ptp(np.trace(turns[k], axis1=2, axis2=3), axis=0).sum())
        notes.append(f"robot's and target's poses stand {how}, the robot's first")
        return dict(zip(SIDES, ways[how], strict=True))
    whole = (n for n, own in arrays.items() if block(own)[:1].size in WIDTHS)
    named = {_LETTER.sub(lambda found: LETTERS[found[0]], name): arrays[name] for name in whole}
    unknown = [name for name, own in named.items() if len(own) > 2]
    if unknown and {*map(_is_seen, named)} == {None}:
        text = f"nothing tells whether {listed(unknown)} are the robot's or the target's"
        text = f"{path} holds one pose in each row" if unknown == [""] else text
        if "image" in arrays:
            raise OptionError(f"{path} holds no poses of a target: {PICTURES}", option="pairs")
        raise OptionError(f"{text}: give a file or folder of each, the robot's first", option="pairs")
    told = {_is_seen(name) for name, own in named.items() if block(own).shape[1:] in ((4, 4), (3, 4))}
    return {n: a for n, a in named.items() if not (_is_seen(n) in told and 2 < block(a)[:1].size < 12)}


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


def _of_one_label(
    arrays: dict[str, Any], numbers: tuple[int, ...], notes: list[str]
) -> tuple[dict[str, Any], Sequence[int]]:
    """Rows of one label, where both sides have a column of such, and the numbers of the pairs."""
    sides = [{n: block(a) for n, a in arrays.items() if _is_seen(n) is seen} for seen in (False, True)]
    counts = [max(map(len, own.values()), default=0) for own in sides]
    labels = [
        [a.astype(str) for n, a in own.items() if LABEL.search(n) and np.unique(a).size == len(a) == count]
        for own, count in zip(sides, counts, strict=True)
    ]
    if all(labels):
        (known, *_), (others, *_) = labels
        _, rows, theirs = np.intersect1d(known, others, return_indices=True)
        rows, theirs = rows[order := np.argsort(rows)], theirs[order]
        if len(rows) < max(counts):
            notes.append(f"{len(rows)} pairs by their labels, of {counts[0]} and {counts[1]} rows")
        both = ({n: a[k] for n, a in own.items()} for own, k in zip(sides, (rows, theirs), strict=True))
        return {n: a for own in both for n, a in own.items()}, (rows + 1).tolist()
    if all(counts) and counts[0] != counts[1]:
        raise ValueError(f"{counts[0]} robot poses and {counts[1]} target poses; give both an id, or as many")
    return arrays, numbers


def _is_seen(name: str) -> bool | None:
    """Whether a name is of what a camera sees, or of what a robot moves; None for neither."""
    kinds = ((True, SEEN), (False, MOVED), (True, VECTORS))
    return next((seen for seen, kind in kinds if any(map(kind.search, _parts(name)))), None)


def _alike(sides: Sequence[Side]) -> tuple[float, np.ndarray, list[tuple[np.ndarray, str]]]:
    """How far the sides turn apart, which rows have both poses, and what their orientations are."""
    parts = [np.asarray(part) for own, _ in sides for part in (own.position, own.rotation)]
    whole = np.all([np.isfinite(a.reshape(len(a), -1)).all(1) for a in parts], axis=0)
    alike, apart = turning_alike(*(own.take(whole) for own, _ in sides))
    return apart, whole, alike


def _poses(grid: Grid, seen: bool, lists: Collection[str], notes: list[str]) -> Side:
    """One side of a table, and which way round names say that its poses are, if they do."""
    head = max(grid.rows[:50], key=lambda row: sum(_is_seen(cell) is not None for cell in row))
    kinds = _sides_of(head, [] if seen else notes)
    joint = JOINT if "q5" in {parse_heading(c).name for c in head} else NO_QUATERNION
    own = [c for c, kind in kinds.items() if kind is seen and not joint.fullmatch(parse_heading(c).name)]
    names = tuple(_heading(c, head) if c in own else c if c == "exclude" else IGNORED for c in head)
    rows = [row + [""] * (len(head) - len(row)) for row in grid.rows]  # nothing was seen in short ones
    table = replace(with_names(replace(grid, rows=rows), names), headings=tuple(head))
    fields = fields_of(table)
    position, left_out = fields.stacked(("x", "y", "z")), excluded_rows(fields)
    for cells in (c for c, name in zip(table.columns, head, strict=True) if DETECTED.fullmatch(name)):
        left_out |= np.array([cell.strip().lower() in FALSE for cell in cells])
    if left_out.all():
        raise grid.error("the target was seen in no row")
    if position is not None:
        empty = np.ptp(position, axis=1) == 0.0  # zeros, or −1, stand where nothing was seen
        left_out |= empty & ~empty.all()
        position[left_out] = np.nan
    rotation, _ = read_orientation(fields, usable=~left_out)
    if rotation is None or position is None:
        raise grid.error(f"no pose of the {SIDES[seen]} under {listed(own or head, longest=4)}")
    way = next((kind for kind in (INVERSE, DIRECT) if any(map(kind.search, own))), None)
    said = [f"the {SIDES[seen]}'s poses are read the other way round, as named"] if way is INVERSE else []
    likely = {"deg": ("angles", "degrees"), "mm": ("lengths", "mm")} if fields.missing_units else {}
    read = (likely[unit] for unit in dict.fromkeys(fields.units.values()) if unit in likely)
    said += (f"{what} of the {SIDES[seen]}'s poses are read as {unit}" for what, unit in read)
    written = written_orientation(fields)
    if written and any(c.removesuffix("_qw") in lists for c in own):
        written = WrittenOrientation("xyzw", np.roll(written.numbers, -1, axis=1))
    told: dict[str, Any] = {"written": written, "source": grid.source, "notes": tuple(said)}
    return Dataset(np.zeros((fields.rows, 1)), position, rotation, **told), way


def _sides_of(head: Sequence[str], notes: list[str]) -> dict[str, bool | None]:
    """Whether columns are of what is seen, or of what the robot moves.

    Where names tell of one side, all others are the other's; of two groups that no name tells of the first is
    the robot's.
    """
    kinds: dict[str, bool | None] = {c: _is_seen(c) for c in head}
    rest, told = [c for c, kind in kinds.items() if kind is None], {*kinds.values()} - {None}
    groups = [name for name, count in Counter(map(_owner, head)).items() if count >= MIN_GROUP]
    groups.sort(key=bool)  # what has no name before its own is the robot's
    if len(told) == 2:
        return kinds
    if len(told) == 1 and (len(rest) >= MIN_GROUP or len(groups) != 2):
        return kinds | dict.fromkeys(rest, True not in told)
    if told:
        wrong = f"nothing tells which of {listed(groups)} is the robot's pose and which the target's"
        raise OptionError(f"{wrong}: rename them 'robot' and 'target'", option="pairs")
    if len(groups) == 2:
        others = f"{groups[0] or 'what has no other name'} is the robot's pose, {groups[1]} the target's"
        notes.append(f"{others}, by their order" if groups[0] else others)
    return {c: len(groups) == 2 and _owner(c) == groups[1] for c in head}


def _owner(heading: str) -> str:
    """What stands before the name of an entry, as 'tag' of 'tag_x' and 'c' of 'crx'; empty for nothing."""
    first, *more = _parts(heading)
    return "" if VECTORS.search(first) else first if more else _ENTRY.sub("", first)


def _parts(heading: str) -> list[str]:
    return _GAP.split(parse_heading(heading).name)


def _heading(cell: str, head: Sequence[str]) -> str:
    """What a heading says beside which pose it is of: `qx` of 'robot_rotation_x', `x[mm]` of 'tag_x_mm'."""
    name, unit = parse_heading(cell)
    name, head = _GAP.sub("_", name), [_GAP.sub("_", parse_heading(c).name) for c in head]
    if name[-1:] in ("x", "X") and name[:-1] + chr(ord(name[-1]) + 1) not in head:
        return IGNORED  # such as an error in px
    *before, last = name.split("_")
    if unit is None and before and last in ("m", "cm", "mm", "deg", "rad"):
        *before, last, unit = *before, last
    whose, owner = 0, _owner(cell)
    if owner and [*map(_owner, head)].count(owner) >= MIN_GROUP:
        whose, last = 1, last if before or {*map(_is_seen, head)} != {None} else last[len(owner) :]
    stem = name.rpartition("_")[0]
    first = int(f"{stem}_0" not in head)
    if last.isdigit() and int(last) - first in range(3) and f"{stem}_{first + 3}" not in head:
        last = "xyz"[int(last) - first]
    if last in ("w", "x", "y", "z") and any(map(TURN.fullmatch, before[whose:])):
        last = ("q" if f"{stem}_w" in head else "r") + last
    elif last.isdigit():
        last = f"{'t' if len(last) > 1 and f'{stem}_16' not in head else 'pose'}_{last}"
    elif re.fullmatch("q[0-4]", last):
        last = f"q{'wxyz'[int(last[1]) - (f'{name[:-1]}0' not in head)]}"
    last = ANGLES.get(last, last)
    return last if unit is None else f"{last}[{unit}]"
