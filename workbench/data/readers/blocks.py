"""Blocks of numbers by name, as programs keep them: .npz, .npy, pickles, JSON, YAML, XML of OpenCV, text of
numbers alone, and folders of such files.

Blocks whose names differ in one running number, as of `robot_00.txt`, `robot_01.txt` … or of `T_0`, `T_1` …,
are the rows of one array.
"""

import io
import json
import pickle
import re
import zipfile
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.base.bounded_process import ChildError
from workbench.base.errors import WorkbenchError
from workbench.data.binary_tables import read_in_child
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.headings import meaning_of
from workbench.data.readers.table import Grid
from workbench.data.readers.text import COMMENTS, decode, read_text

MAX_BYTES, MAX_FILES = 256 * 2**20, 20_000
"""Maximum size of unpacked arrays, and number of files of a folder."""
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".webp")
BLOCKS = (".txt", ".csv", ".tsv", ".dat", ".json", ".yaml", ".yml", ".xml", ".npy", ".npz", ".pkl", ".pickle")
"""Endings of pictures, and of files that may hold a block."""
NUMPY = (b"\x93NUMPY", b"PK\x03\x04", b"\x80")
"""How arrays of NumPy and pickles begin."""
_DAMAGED = ValueError, OSError, EOFError, KeyError, NotImplementedError, MemoryError, zipfile.BadZipFile
MATRICES = ((4, 4), (3, 4), (3, 3))
"""Shapes of poses and rotations."""
_CLASSES = {
    f"numpy.core.{name}" for name in ("multiarray._reconstruct", "multiarray.scalar", "numeric._frombuffer")
}
_CLASSES |= {"numpy.ndarray", "numpy.dtype", "collections.OrderedDict", "_codecs.encode"}
"""All that a pickle may name."""
_RUNNING = re.compile(r"\d+(?![a-zA-Z\d])(?!.*\d(?![a-zA-Z\d]))")
"""The last number of a name that no letter follows, as in 'pose_3_gripper2base'."""
_OPENED, _CLOSED = re.compile(r"<(\w+)[^>]*>"), re.compile(r"</\w+>")
_STORED = re.compile(
    r"(\w+): *\[?(?:!!opencv-matrix)?\s*rows: *\[?(\d+)\]?\s*cols: *\S+\s*(?:dt: *\S+\s*)?data: *\[([^\]]*)"
)
"""Tags of XML, and OpenCV's matrices in YAML, or in XML whose tags are like keys of it."""
_YAML = re.compile(r"^\W*[A-Za-z_]\w*[\"']?\s*[:=]", re.M)
_TOKEN = re.compile(r"([A-Za-z_]\w*)[\"']?\s*[:=]|(?<![\w.])([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)(?![\w.])")
_NUMBER = re.compile(r"(^|_)\d+$")
TURN = re.compile(r"r|rotations?|orientations?|quat\w*|rot\w*|rvecs?", re.I)
_PLACE = re.compile(r"translation|position", re.I)


class Arrays(NamedTuple):
    """Arrays by name, the running number of each row where they have one, and what was decided."""

    arrays: dict[str, Any]
    numbers: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()


Owner = Callable[[str], bool]
"""Whether the name of an object in YAML says whose pose is below it."""


def arrays_in(paths: Mapping[str, Path], owner: Owner = lambda name: False) -> Arrays:
    """All blocks of files, and of the files in folders, by the names before which theirs stand; of one file
    none where it is a table under headings."""
    blocks, tables = dict[tuple[str, str], np.ndarray](), set[str]()
    for label, path in paths.items():
        for file in sorted(islice(path.rglob("*"), MAX_FILES)) if path.is_dir() else [path]:
            own = "" if file == path else file.relative_to(path).with_suffix("").as_posix()
            stem, ending = "/".join(filter(None, (label, own))), file.suffix.lower()
            if ending in PICTURES:
                blocks[stem, "image"] = np.array(file.name)
            with suppress(*(() if file == path else (WorkbenchError, ValueError))):
                data = read_bytes(file) if ending in BLOCKS or file == path else b""
                found = arrays_of(data, file, owner) if data else {}
                if stem and data and not found and (found := _columns(read_text(data, file))):
                    tables |= {stem} if max(map(len, found.values())) > 1 else set()
                blocks |= {(stem, name): block(values) for name, values in found.items()}
    return _in_rows(blocks, tables, are_named=len(paths) > 1)


def arrays_of(data: bytes, path: Path, owner: Owner = lambda name: False) -> dict[str, Any]:
    """Blocks of one file by their names, '' where they have none."""
    if data.startswith(NUMPY) and b"xl/" not in data:
        try:
            return numpy_arrays(data, pickled=False)
        except (*_DAMAGED, ChildError):
            what, instead = "these arrays", "save them as .npz, without objects"
            return read_in_child(numpy_arrays, data, path, needs="numpy", what=what, instead=instead)
    if data.startswith(b"PK"):
        return {}
    text = decode(data, path)[0]
    if text.lstrip().startswith("<"):
        text = _CLOSED.sub("]", _OPENED.sub(r"\n\1: [", text))
    if stored := _STORED.findall(text):
        sizes = ((name, int(rows), re.findall(r"[-+.\w]+", own)) for name, rows, own in stored)
        return {name: upright(np.array(own, float).reshape(rows, -1)) for name, rows, own in sizes}
    if (numbers := _numbers(text)) is not None:
        return {"": numbers}
    if not _YAML.search(text):
        return {}
    return arrays_of_json(data) or _samples(text, owner)


def numpy_arrays(data: bytes, *, pickled: bool = True) -> dict[str, Any]:
    """The arrays of an .npz or .npy by name, or of a pickle of such, which is read in a child."""
    if not data.startswith(b"PK"):
        return by_name(_array_of(io.BytesIO(data), pickled))
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > MAX_BYTES:
            raise ChildError(f"it unpacks to more than {MAX_BYTES >> 20} MiB")
        files = [name for name in archive.namelist() if name.endswith(".npy")]
        return {name[:-4]: _array_of(io.BytesIO(archive.read(name)), pickled) for name in files}


def _array_of(file: io.BytesIO, pickled: bool) -> Any:
    """An array, or what a pickle of arrays holds, which may stand behind the head of an array of objects."""
    try:
        found = np.lib.format.read_array(file, allow_pickle=False)
    except ValueError:
        if not pickled:
            raise
        file.seek(0 if file.getvalue().startswith(b"\x80") else file.tell())
        found = _Unpickler(file).load()
    return found.tolist() if isinstance(found, np.ndarray) and found.dtype == object else found


class _Unpickler(pickle.Unpickler):
    """Loads arrays, numbers and containers; what names anything else is refused before it is looked up."""

    def find_class(self, module: str, name: str) -> Any:
        if f"{module.replace('._core', '.core')}.{name}" not in _CLASSES:
            raise ChildError(f"'{module}.{name}' in it is none of NumPy's arrays")
        return super().find_class(module, name)


def arrays_of_json(data: bytes) -> dict[str, Any]:
    """Rows of each name."""
    found = None
    with suppress(ValueError, RecursionError):  # text that isn't UTF-8 is a ValueError, too
        text = data.decode("utf-8-sig")
        try:
            found = json.loads(text)
        except json.JSONDecodeError:
            found = [json.loads(line) for line in text.splitlines() if line.strip()]
    return by_name(found)


def by_name(found: Any) -> dict[str, Any]:
    """Rows of each name, of objects of arrays, of lists of objects, one a row, or of two stacks of poses."""
    leaves = _leaves("", found) if isinstance(found, dict | list | tuple | np.ndarray) else {}
    lists = {name: v for name, v in leaves.items() if isinstance(v, list) and v and isinstance(v[0], dict)}
    rows = {
        name: [_leaves("", row) for row in v]
        for name, v in lists.items()
        if all(isinstance(r, dict) for r in v)
    }
    if len(rows) == 1:
        leaves, rows = {}, {"": next(iter(rows.values()))}
    leaves = {name: value for name, value in leaves.items() if name not in rows}
    for name, each in rows.items():
        leaves |= {f"{name}_{key}".lstrip("_"): [row.get(key) for row in each] for key in each[0]}
    if (array := block(leaves.get("", ()))).ndim > 1:
        leaves = (
            {"A": array[0], "B": array[1]} if array.ndim == 4 and len(array) == 2 else {"": upright(array)}
        )
    return leaves


def _leaves(name: str, value: Any) -> dict[str, Any]:
    """Values of an object by their paths: `pose_position_x`."""
    if not isinstance(value, dict):
        return {name: value}
    inside = (_leaves(f"{name}_{key}".lstrip("_"), inner) for key, inner in value.items())
    return {path: leaf for leaves in inside for path, leaf in leaves.items()}


def _samples(text: str, owner: Owner) -> dict[str, np.ndarray]:
    """Numbers of JSON or YAML by the keys before them, those of the pose and of its part among them."""
    found, side, part, name = defaultdict[str, list[list[float]]](list), "", "", ""
    for key, number in _TOKEN.findall(text):
        if key:
            key = _NUMBER.sub("", key)
            side, part = (key, "") if owner(key) else (side, part)
            part = key if TURN.fullmatch(key) or _PLACE.fullmatch(key) else part
            name = "_".join(filter(None, dict.fromkeys((side, part, key))))
            found[name].append([])
        elif name:
            found[name][-1].append(float(number))
    whole = {name: [row for row in rows if row] for name, rows in found.items()}
    arrays = {name: np.array(rows) for name, rows in whole.items() if len(set(map(len, rows))) == 1}
    shapes = {1: (-1,), 9: (-1, 3, 3)}
    long = {name: a.reshape(-1, 16) if a.size % 16 == 0 and len(a) == 1 else a for name, a in arrays.items()}
    return {name: a.reshape(shapes.get(a.shape[1], a.shape)) for name, a in long.items()}


def _numbers(text: str) -> np.ndarray | None:
    """Text of numbers alone; their count may stand above. None of any other."""
    lines = (re.sub(r"[\[\](){},;]", " ", line).split() for line in text.splitlines())
    rows = [
        line for line in lines if line and not line[0].startswith(tuple(mark.strip() for mark in COMMENTS))
    ]
    try:
        numbers = [[float(cell) for cell in row] for row in rows]
    except ValueError:
        return None
    numbers = numbers[1:] if len(numbers) > 1 == len(numbers[0]) < len(numbers[1]) else numbers
    widths = set(map(len, numbers))
    return upright(np.array(numbers)) if len(widths) == 1 and numbers else None


def upright(numbers: np.ndarray) -> np.ndarray:
    """A row whose numbers stand one below another as a row, and matrices that stand so one by one."""
    if numbers.ndim == 2 and numbers.shape[1] == 1 and numbers.size in (3, 4, 6, 7, 12, 16):
        return numbers.reshape(1, -1)
    for height, width in MATRICES if numbers.ndim == 2 else ():
        if numbers.shape[1] == width and len(numbers) % height == 0:
            turns = (blocks := numbers.reshape(-1, height, width))[:, :3, :3]
            if np.abs(np.swapaxes(turns, 1, 2) @ turns - np.eye(3)).max() < 0.1:
                return blocks if len(blocks) > 1 else blocks[0]
    return numbers


def _columns(grid: Grid) -> dict[str, Any]:
    """The columns of a table under headings; one of times and poses as it stands."""
    head, *body = grid.rows
    if [meaning_of(name) for name in head[:4]] == ["time", "x", "y", "z"] and len(head) == 8:
        with suppress(ValueError):
            return {"": np.array(body, float)}
    return dict(zip(head, zip(*body, strict=True), strict=True)) if body else {}


def block(values: Any) -> np.ndarray:
    """Numbers or labels as an array; an empty one where they are none."""
    with suppress(ValueError):
        if (array := np.asarray(values)).dtype.kind in "fiubUS":
            return array
    return np.zeros(0)


def _in_rows(blocks: Mapping[tuple[str, str], np.ndarray], tables: set[str], are_named: bool) -> Arrays:
    """Blocks with running numbers as arrays of rows, all others as they are, by short names.

    Args:
        blocks: By the file's name and their own.
        tables: Files with a table each, whose numbers don't count rows.
        are_named: Whether names of files belong to those of arrays in any case.
    """
    series, found = (
        defaultdict[tuple[str, str], dict[int, np.ndarray]](dict),
        dict[tuple[str, str], np.ndarray](),
    )
    numbered = {key: _RUNNING.search(key[0]) or _RUNNING.search(key[1]) for key in blocks}
    of_poses = {m[0] for key, m in numbered.items() if m and blocks[key].shape in MATRICES}
    for (stem, name), own in blocks.items():
        number, in_name = numbered[stem, name], not _RUNNING.search(stem)
        row = own[0] if own.ndim and len(own) == 1 else own.ravel() if own.shape[1:] == (1,) else own
        is_row = row.size and (row.ndim < 2 or row.shape in MATRICES) and stem not in tables
        if number is None or not is_row or (in_name and number[0] not in of_poses):
            found[stem, name] = own
            continue
        part = name if in_name else stem
        rest = part[: number.start()] + part[number.end() :]
        series[(stem, rest) if in_name else (rest, name)].setdefault(int(number[0]), row)
    pictures = [key for key in series if key[1] == "image"]
    for key in pictures if len(pictures) > 1 else ():  # of several cameras, or of depths
        del series[key]
    shapes = {
        key: Counter(r.shape for r in rows.values()).most_common(1)[0][0] for key, rows in series.items()
    }
    whole = {key: {n: r for n, r in rows.items() if r.shape == shapes[key]} for key, rows in series.items()}
    most = max(map(len, whole.values()), default=0)
    whole = {key: rows for key, rows in whole.items() if 2 * len(rows) > most > 1}
    numbers = sorted(set.intersection(*map(set, whole.values()))) if whole else []
    found = {key: own for key, own in found.items() if not numbers or own.shape[:1] == (len(numbers),)}
    notes = list[str]()
    for key, rows in whole.items():
        found[key] = np.array([rows[number] for number in numbers])
        if lost := sorted(set().union(*whole.values()) - set(rows)):
            notes.append(f"without {_plain(*key)}, left out: {', '.join(map(str, lost))[:60]}")
    names = {key: _plain(key[1] or key[0]) for key in found}
    if are_named or len(set(names.values())) < len(names):
        names = {key: _plain(*key) for key in found}
    return Arrays({names[key]: array for key, array in found.items()}, tuple(numbers), tuple(notes))


def _plain(*names: str) -> str:
    return re.sub(r"[\W_]+", "_", "_".join(names)).strip("_")
