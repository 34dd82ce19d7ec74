"""Arrays by name, as programs keep them: .npz, .npy, JSON, YAML, XML of OpenCV, text of numbers,
and folders of such files, where files that differ in one number are rows: `robot_00.txt`, `robot_01.txt` …

An array of rows is a column, or several: joints `q1 …`, places `x y z`, quaternions, poses and rotations by
their entries. Their units, and the order of a quaternion, are told by the rows like those of any table.
"""

import io
import json
import re
import zipfile
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.base.errors import FileError, WorkbenchError
from workbench.base.units import parse_heading
from workbench.data.binary_tables import refusal
from workbench.data.readers import headings
from workbench.data.readers.file_kind import POSE_PAIRS, PROGRAM, TABLE, read_bytes
from workbench.data.readers.headings import known_together, meaning_of, normalised
from workbench.data.readers.layouts import layouts
from workbench.data.readers.table import Grid, grid_of
from workbench.data.readers.text import decode, read_text

MAX_BYTES, MAX_FILES = 256 * 2**20, 20_000
"""Maximum size of unpacked arrays, and number of files of a folder."""
PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".webp")
BLOCKS = (".txt", ".csv", ".tsv", ".dat", ".json", ".yaml", ".yml", ".xml", ".npy", ".npz", ".mat")
"""Endings of pictures, and of files that may hold a block."""
_RUNNING = re.compile(r"\d+(?![a-zA-Z\d])(?!.*\d(?![a-zA-Z\d]))")
"""The last number of a name that no letter follows, as in 'pose_3_gripper2base'."""
_OPENED, _CLOSED = re.compile(r"<(\w+)[^>]*>"), re.compile(r"</\w+>")
"""Tags of XML, read as keys are."""
_YAML = re.compile(r"\A\{|^\W*[A-Za-z_]\w*[\"']?\s*[:=]|^[rt] +[-+\d]", re.M)  # or of Halcon
_KEY = r"((?<!%)\b[A-Za-z_]\w*(?=[\"']?\s*[:=])|^[rt](?= +[-+\d]))"
_COUNT = r"((?<![\w.])\d+)(?=[\"']?\s*:)"
_TOKEN = re.compile(
    rf"{_KEY}|{_COUNT}|(?<![\w.])([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)(?![\w.])|([\[{{])|([\]}}])", re.M
)
"""Keys, numbers of rows in their place, numbers, and brackets."""
_NUMBER = re.compile(r"(?:^|_)(\d+)$")
_NAMED = r"\b([A-Za-z_]\w*)[ \t]*[:= ][ \t]*([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)[ \t]*(deg|rad|mm|m|°)?(?![\w.])"
"""A number behind its name and before its unit."""
_PAGE = re.compile(r"^[ \t]*\w*\(:,:,\d+\)[ \t]*=\s*$", re.M)
"""What MATLAB prints above each matrix of a stack."""
_COMMENT = re.compile(r"^[ \t]*(?:#|%|//|;|!).*", re.M)
TURN = re.compile(r"r|rotations?|orientations?|quat\w*|rot\w*|rvecs?", re.I)
_TELLS = re.compile(rf"{TURN.pattern}|t|translation|position|.*joint.*", re.I)
"""Keys around others that say what these are."""
_JOINTS = re.compile("q|angles|(\\w+_)?joints?(?:_(?:pose|positions|angles|states|values))?")
_PLACES = re.compile("(?:.*_)?(?:xyz|positions?|translations?|[tr]_?vec|points?|[pt]|tcp)")
_LIST, _ENTRY = re.compile(r"[\[(](.*)[\])]", re.DOTALL), re.compile(r"'[^']*'|\"[^\"]*\"|[^\s,;]+")
_BRACKETED = re.compile(r"\W*\w?[\[({]([^\[\](){}]*)[\])}][^\[\](){}]*")
"""A line such as `p[0.1, …]  12:30:01`."""
_MATRICES = {(4, 4): "t", (3, 4): "t", (3, 3): "r"}


class Arrays(NamedTuple):
    """Arrays by name, the running number of each row where they have one, and what was decided."""

    arrays: dict[str, Any]
    numbers: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()


def arrays_in(paths: Mapping[str, Path], owner: Callable[[str], bool] = lambda name: False) -> Arrays:
    """All blocks of files, and of the files in folders, by the names before which theirs stand; of one file
    none where it is a table under headings. `owner` knows names in YAML of whose pose is below."""
    blocks = dict[tuple[str, str], np.ndarray]()
    for label, path in paths.items():
        for file in sorted(islice(path.rglob("*"), MAX_FILES)) if path.is_dir() else [path]:
            own = "" if file == path else file.relative_to(path).with_suffix("").as_posix()
            stem, ending = "/".join(filter(None, (label, own))), file.suffix.lower()
            if ending in PICTURES:
                blocks[stem, "image"] = np.array([file.name])
            elif file == path or ending in BLOCKS:
                with suppress(*(() if file == path else (WorkbenchError, ValueError))):
                    special = (known.arrays(file) for known in layouts()[1] if ending in known.endings)
                    found = next(special, {}) or arrays_of(read_bytes(file), file, owner, headed=bool(stem))
                    blocks |= {(stem, name): block(values) for name, values in found.items()}
    return _in_rows(blocks, are_named=len(paths) > 1)


def arrays_of(data: bytes, path: Path, owner: Callable[[str], bool], *, headed: bool) -> dict[str, Any]:
    """Blocks of one file by their names, '' where they have none; columns of a table if `headed`."""
    if data.startswith((b"\x93NUMPY", b"PK\x03\x04", b"\x80")) and b"xl/" not in data:  # or a pickle
        try:
            return numpy_arrays(data)
        except Exception as error:  # whatever NumPy makes of a damaged file
            why = "a pickle may run code" if "pickle" in str(error) else str(error)
            raise refusal("these arrays", why, "save them as .npz, without objects", path) from None
    if data.startswith(b"PK"):
        return {}
    text = _PAGE.sub("", decode(data, path)[0])
    if text.lstrip().startswith("<"):
        text = _CLOSED.sub("]", _OPENED.sub(r"\n\1: [", text))
    if _YAML.search(text):
        found = arrays_of_json(data)
        return found if any(isinstance(v, list) for v in found.values()) else _samples(text, owner)
    inside = [_BRACKETED.fullmatch(line) for line in text.splitlines() if line.strip()]
    bare = "\n".join(m[1] for m in inside if m) if all(inside) else re.sub(r"[\[\](){}]", " ", text)
    head, *body = read_text(bare.encode(), path).rows
    is_count = len(head) == 1 < len(body) and len(body[0]) > 1  # of blocks
    with suppress(ValueError):
        return {"": upright(np.array(body if is_count else [head, *body], float))}
    if [meaning_of(name) for name in head[:4]] == ["time", "x", "y", "z"] and len(head) == 8:
        with suppress(ValueError):
            return {"": np.array(body, float)}
    is_even = body and {*map(len, body)} == {len(head)}
    return dict(zip(head, zip(*body, strict=True), strict=True)) if headed and is_even else {}


def arrays_of_names(data: bytes, path: Path) -> dict[str, Any]:
    """Numbers behind their names, as in lines `q1=12.3 deg q2=…`; of a robot's program joints alone, as its
    places are where the arm should be. None of another text."""
    is_program = bool(re.match(PROGRAM, data[:4000]))
    begin = _bare(data[: 20_000 if is_program else 200].decode("utf-8", "ignore"))
    if not {"q1", "q2", "q3"} <= {meaning_of(match[1]) for match in re.finditer(_NAMED, begin)}:
        return {}
    text, rows = _bare(decode(data, path)[0]), list[dict[str, float]]()
    lines = [text] if is_program else text.splitlines()
    for number, line in enumerate(lines, 1):
        rows.append(row := dict[str, float]())
        for name, value, unit in re.findall(_NAMED, line):
            if is_program and not re.fullmatch(r"q\d+", meaning_of(name) or ""):
                continue
            if (key := f"{name}[{unit}]" if unit else name) in row:
                if not is_program:
                    raise FileError(f"'{name}' stands twice: leave one out", path=str(path), line=number)
                rows.append(row := dict[str, float]())
            row[key] = float(value)
    rows = [row for row in rows if any(meaning_of(key.partition("[")[0]) == "q1" for key in row)]
    if len(rows) < 2 or 2 * len(rows) < sum(map(bool, map(str.strip, lines))):
        return {}
    keys = dict.fromkeys(chain.from_iterable(rows))
    return {key: [row.get(key, np.nan) for row in rows] for key in keys}


def _bare(text: str) -> str:
    """A text without comments, joints of RAPID behind their names."""
    named = lambda found: " ".join(f"q{k} {v}" for k, v in enumerate(found[1].split(","), 1))  # noqa: E731
    return re.sub(r"\bjointtarget\s+\w+\s*:=\s*\[\[([^]]*)\]", named, _COMMENT.sub("", text))


def numpy_arrays(data: bytes) -> dict[str, Any]:
    """The arrays of an .npz or .npy by name."""
    if not data.startswith(b"PK"):
        return by_name(np.load(io.BytesIO(data), allow_pickle=False))
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > MAX_BYTES:
            raise ValueError(f"it unpacks to more than {MAX_BYTES >> 20} MiB")
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        return {name: block(file[name]) for name in file.files}


def arrays_of_json(data: bytes) -> dict[str, Any]:
    """Rows of each name."""
    with suppress(ValueError, RecursionError):  # text that isn't UTF-8 is a ValueError, too
        text = data.decode("utf-8-sig")
        try:
            return by_name(json.loads(text))
        except json.JSONDecodeError:
            return by_name([json.loads(line) for line in text.splitlines() if line.strip()])
    return {}


def by_name(found: Any) -> dict[str, Any]:
    """Rows of each name, of an object of arrays, of a list of objects, one a row, or of stacks of poses."""
    lists = [v for v in (found.values() if isinstance(found, dict) else [found]) if isinstance(v, list) and v]
    lists = [rows for rows in lists if all(isinstance(row, dict) for row in rows)]
    if len(lists) == 1 or isinstance(found, dict):
        return _leaves("", lists[0] if len(lists) == 1 else found)
    array = block([] if found is None else found)
    if array.ndim == 4 and 2 in array.shape[:2]:
        return dict(zip("AB", array if len(array) == 2 else np.moveaxis(array, 1, 0), strict=True))
    return {"": upright(array)} if array.ndim > 1 else {}


def _leaves(name: str, value: Any) -> dict[str, Any]:
    """Values of an object by their paths, `pose_position_x`, and of a list of objects in rows."""
    if isinstance(value, dict) and value and all(map(str.isdigit, value)):  # rows by their numbers
        value = [value[key] for key in sorted(value, key=int)]
    if name and isinstance(value, list) and len(value) == 1 and isinstance(value[0], dict):  # a lone marker
        value = value[0]
    if isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
        rows = [_leaves(name, row) for row in value]
        return {path: [row.get(path) for row in rows] for path in rows[0]}
    if not isinstance(value, dict):
        return {name: value}
    inside = (_leaves(f"{name}_{key}".lstrip("_"), inner) for key, inner in value.items())
    return {path: leaf for leaves in inside for path, leaf in leaves.items()}


def _samples(text: str, owner: Callable[[str], bool]) -> dict[str, np.ndarray]:
    """Numbers of JSON or YAML by their keys, and those around that say of what they are."""
    found, path = defaultdict[str, list[tuple[int, list[float]]]](list), list[tuple[tuple[int, int], str]]()
    depth, column, at, name = 0, 0, -1, ""
    for token in _TOKEN.finditer(text):
        key, count, number, opens, closes = token.groups()
        depth += bool(opens) - bool(closes)
        if key:
            key, count, *_ = *_NUMBER.split(key), ""
            column = column if depth else token.start() - text.rfind("\n", 0, token.start())
            path = [*(outer for outer in path if outer[0] < (column, depth)), ((column, depth), key)]
            keys, is_matrix = [own for _, own in path], key in ("rows", "cols", "dt", "data")
            begin = max((k for k, own in enumerate(keys) if owner(own)), default=0)
            told = (own for own in keys[begin:-1] if is_matrix or owner(own) or _TELLS.fullmatch(own))
            name = "_".join(dict.fromkeys([*told, key]))
        at = int(count or at)
        if key or (count and name):
            found[name].append((at, []))
        elif name and number:
            found[name][-1][1].append(float(number))
    for rows in found.values():
        if len({number for number, _ in rows}) == len(rows):  # else numbers don't tell them apart
            rows.sort(key=lambda row: row[0])
    whole = {name: [row for _, row in rows if row] for name, rows in found.items()}
    arrays = {name: np.array(rows) for name, rows in whole.items() if len(set(map(len, rows))) == 1}
    for name in [name for name in arrays if name.endswith("cols")]:  # of OpenCV
        data, width = arrays.get(f"{name[:-4]}data", np.zeros(0)), int(arrays[name].flat[0])
        if width > 1 and data.size % width == 0:
            arrays[f"{name[:-4]}data"] = upright(data.reshape(-1, width))
    lone = {name: upright(a.reshape(-1, 4)) for name, a in arrays.items() if len(a) == 1 and a.size % 4 == 0}
    arrays |= {name: stack for name, stack in lone.items() if stack.ndim == 3}  # a list of matrices
    shapes = {1: (-1,), 9: (-1, 3, 3), 16: (-1, 4, 4)}
    return {name: a.reshape(shapes.get(a.shape[1], a.shape)) for name, a in arrays.items()}


def upright(numbers: np.ndarray) -> np.ndarray:
    """A row whose numbers stand one below another as a row, and matrices that stand so one by one."""
    if numbers.ndim == 2 and numbers.shape[1] == 1 and numbers.size in (3, 4, 6, 7, 12, 16):
        return numbers.reshape(1, -1)
    for height, width in _MATRICES if numbers.ndim == 2 and numbers.size else ():
        if numbers.shape[1] == width and len(numbers) % height == 0:
            turns = (blocks := numbers.reshape(-1, height, width))[:, :3, :3]
            if np.abs(np.swapaxes(turns, 1, 2) @ turns - np.eye(3)).max() < 0.1:
                return blocks if len(blocks) > 1 else blocks[0]
    return numbers


def block(values: Any) -> np.ndarray:
    """Numbers or labels as an array; an empty one where they are none."""
    with suppress(ValueError):
        if (array := np.asarray(values)).dtype.kind in "fiubUS":
            return np.atleast_1d(array)
    return np.zeros(0)


def _in_rows(blocks: Mapping[tuple[str, str], np.ndarray], are_named: bool) -> Arrays:
    """Blocks with running numbers as arrays of rows, and all others as they are.

    Args:
        blocks: By the file's name and their own.
        are_named: Whether names of files belong to those of arrays in any case.
    """
    series, found = defaultdict[tuple, dict[int, np.ndarray]](dict), dict[tuple[str, str], np.ndarray]()
    for (stem, name), own in blocks.items():
        row = own.ravel() if own.shape[1:] == (1,) else own[0] if len(own) == 1 else own
        is_column = own.dtype.kind == "U" and row.ndim > 0
        if (number := _RUNNING.search(stem)) and not is_column and (row.ndim < 2 or row.shape in _MATRICES):
            series[_RUNNING.sub("", stem), name, row.shape].setdefault(int(number[0]), row)
        else:
            found[stem, name] = own
    pictures, most = [key for key in series if key[1] == "image"], max(map(len, series.values()), default=0)
    several = pictures if len(pictures) > 1 else []  # of cameras, or depths
    rows_of = ((key, rows) for key, rows in series.items() if 2 * len(rows) > most > 1 and key not in several)
    whole = {(stem, name): rows for (stem, name, _), rows in rows_of}
    numbers = sorted(set.intersection(*map(set, whole.values()))) if whole else []
    found = {key: own for key, own in found.items() if len(own) == len(numbers)} if numbers else found
    found |= {key: np.array([rows[number] for number in numbers]) for key, rows in whole.items()}
    lost = {key: sorted(set().union(*whole.values()) - set(rows)) for key, rows in whole.items()}
    notes = [f"without {_plain(*key)}, left out: {str(own)[1:-1][:60]}" for key, own in lost.items() if own]
    names = {key: _plain(key[1] or key[0]) for key in found}
    if are_named or len(set(names.values())) < len(names):
        names = {key: _plain(*key) for key in found}
    return Arrays({names[key]: array for key, array in found.items()}, tuple(numbers), tuple(notes))


def _plain(*names: str) -> str:
    return re.sub(r"[\W_]+", "_", "_".join(names)).strip("_")


def read_arrays(path: Path) -> Grid | None:
    """The arrays of a file, or of the numbered files of a folder, as a table; None of a folder without."""
    found = arrays_in({"": path})
    if path.is_dir() and not found.numbers:
        return None
    if [*found.arrays] == [""] and (rows := found.arrays[""]).ndim == 2:  # whose columns have no names
        return Grid(source=str(path), rows=rows.astype(str).tolist(), lines=list(range(1, len(rows) + 1)))
    what = "these are arrays, JSON or YAML" if path.is_file() else "these are numbered files"
    grid = table_of(found.arrays, path, what)
    lines = [0, *found.numbers] if len(found.numbers) == len(grid.rows) - 1 else grid.lines
    return replace(grid, lines=lines, notes=(*found.notes, *grid.notes))


def table_of(arrays: Mapping[str, Any], path: Path, what: str = "") -> Grid:
    """Arrays as long as the joints, or as most are, side by side; without `what`, under their whole names."""
    columns, left_out = dict[str, list[str]](), list[str]()
    upright = {str(name): block(own) for name, own in arrays.items()}
    rows, upright = _upright(upright) if what else (max(map(len, upright.values())), upright)
    for name, array in upright.items():
        is_apart = any(map(_PLACES.fullmatch, map(str.lower, upright)))
        if is_apart and array.shape[1:] == (4, 4) and not array[:, :3, 3].any():  # a turn alone
            array = array[:, :3, :3]
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
    if what and (not rows or not (any(map(meaning_of, columns)) or known_together(columns))):
        text = f"{what}, but no arrays with joints and places of rows; {POSE_PAIRS}; {TABLE}"
        raise FileError(text, path=str(path))
    notes = [f"left out, as not of {rows} rows: {', '.join(left_out)[:200]}"] if left_out else []
    return grid_of(list(columns), columns.values(), source=str(path), notes=notes)


def with_lists(grid: Grid) -> Grid:
    """The cells with a column for each entry of lists, as pandas writes arrays, where all are equally long.

    Labels, such as `(1, 2)` of a grid, stay; so does what has columns of its own.
    """
    head, *body = grid.rows or [[]]
    lists = dict[int, list[list[str]]]()  # headings, and the entries of each row
    width, cells = len(head), [""]
    for k in sorted({k for row in body for k, c in enumerate(row[:width]) if c.startswith(("[", "("))}):
        name, cells = head[k], [row[k] for row in body if len(row) == width]
        found = [_ENTRY.findall(m[1]) if (m := _LIST.fullmatch(cell)) else [] for cell in cells]
        if len(sizes := {len(f) for f, cell in zip(found, cells, strict=True) if cell}) == 1 < max(sizes):
            is_label = not headings.quantities_of(meaning_of(name) or "q1")
            if not is_label and (names := _headings(name, (size := max(sizes),))):
                lists[k] = [names, *([e.strip("'\"[]()") for e in f] or [""] * size for f in found)]
    plain = {meaning_of(name) for k, name in enumerate(head) if k not in lists} - {None}
    lists = {k: own for k, own in lists.items() if not plain & set(map(meaning_of, own[0]))}
    if not lists or len(cells) < len(body):
        return grid
    rows = ([lists[k][i] if k in lists else [c] for k, c in enumerate(r)] for i, r in enumerate(grid.rows))
    note = f"lists in cells are columns: {', '.join(head[k] for k in lists)}"
    return replace(grid, rows=[[*chain(*row)] for row in rows], notes=(*grid.notes, note))


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
    (plain, unit), (name, said) = headings.unit_apart(name), parse_heading(name)
    plain, unit = plain.lower(), f"[{unit}]" if unit else ""
    if shape in _MATRICES and not headings.is_commanded(name):
        return [f"{_MATRICES[shape]}{i + 1}{j + 1}" for i, j in np.ndindex(shape)]
    if len(shape) != 1:
        return [f"{name}{f'[{said}]' if said else ''}"] if not shape else []
    if joints := _JOINTS.fullmatch(plain):
        return [f"{joints[1] or ''}q{k + 1}{unit}" for k in range(shape[0])]
    first, _, _ = plain.partition("_" if headings.is_of_measurement(name) else "\n")
    is_place = any(map(_PLACES.fullmatch, (first, plain))) or meaning_of(f"{plain}_x") == "x"
    if shape == (3,) and is_place and not headings.is_commanded(name):
        return [f"{'r' * ('rvec' in plain)}{axis}{unit}" for axis in "xyz"]
    if shape == (4,):
        return ["qw", "qx", "qy", "qz"]
    return [f"{name}_{k + 1}{unit if said else ''}" for k in range(shape[0])]
