"""Boards to print, and corners of boards and tags found in a folder of pictures.

A ChArUco board's inner corners are found beside its markers and refined to parts of a pixel; so are the
corners of single tags. A picture without the target gets the reason.
"""

import contextlib
import io
import os
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image, ImageOps

from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.files import read_bytes
from workbench.base.progress import Cancelled, cancelled, progress
from workbench.base.wording import listed, plural
from workbench.data.readers.arrays import PICTURES
from workbench.data.readers.fields import Fields
from workbench.extras.camera.camera import opencv
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import Charuco, PictureTarget

COMMON_NAMES = (
    *("DICT_6X6_250", "DICT_5X5_250", "DICT_4X4_250", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"),
    *("DICT_7X7_250", "DICT_6X6_1000", "DICT_5X5_1000", "DICT_4X4_1000", "DICT_7X7_1000"),
)
"""Dictionaries in which markers are sought where the right one shows none; the larger hold the smaller."""
MIN_FOUND = 4
"""Corners, or markers, that a picture must show."""

MAX_PIXELS = 250_000_000
"""Larger pictures are refused, as a small file may unpack to gigabytes; sensors have 150 million at most."""

Image.MAX_IMAGE_PIXELS = MAX_PIXELS

Picture = UInt8[np.ndarray, "height width"]
Corners = Float[np.ndarray, "n 4"]
"""Of tags, or of boards: id, number of the tag's corner, and where it is in the picture [px]."""


@cache
def dictionary(name: str) -> Any:
    number = getattr(opencv().aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        usual = ", ".join(COMMON_NAMES[:4])
        raise OptionError(f"unknown marker dictionary '{name}'; use one such as {usual}")
    return opencv().aruco.getPredefinedDictionary(number)


def opencv_board(board: Charuco) -> Any:
    across, down = board.squares
    if board.markers.stop > len(dictionary(board.dictionary).bytesList):
        after = f" from {board.first_marker} on" if board.first_marker else ""
        needs = f"a board of {across} x {down} squares needs {len(board.markers)} markers{after}"
        text = f"{needs}, {board.dictionary} has fewer; choose a larger dictionary or fewer squares"
        raise OptionError(text, option="dictionary", found=board.dictionary)
    prints, own = dictionary(board.dictionary), np.array(board.markers)
    return opencv().aruco.CharucoBoard(board.squares, board.square, board.marker, prints, own)


def markers_in(picture: Picture, name: str) -> tuple[Float[np.ndarray, "n 4 2"], Int[np.ndarray, " n"]]:
    """Corners of a dictionary's markers in a picture, to parts of a pixel, and their numbers."""
    settings = opencv().aruco.DetectorParameters()
    settings.cornerRefinementMethod = opencv().aruco.CORNER_REFINE_SUBPIX
    corners, names, _ = opencv().aruco.ArucoDetector(dictionary(name), settings).detectMarkers(picture)
    if names is None or not len(names):
        return np.zeros((0, 4, 2)), np.zeros(0, int)
    return np.array(corners, float).reshape(-1, 4, 2), np.asarray(names).ravel().astype(int)


@dataclass(frozen=True, eq=False)
class BoardFinder:
    """Finds boards and tags in pictures.

    Args:
        targets: What is looked for, each with its dictionary.
        notes: What was decided about them.
        older: Boards with an even number of rows as OpenCV before 4.6 printed them.
    """

    targets: tuple[PictureTarget, ...]
    notes: tuple[str, ...] = ()
    older: tuple[PictureTarget, ...] = ()

    @classmethod
    def of(cls, targets: Sequence[PictureTarget], pictures: Sequence[Picture] = ()) -> "BoardFinder":
        """The finder of targets; what nobody gave of them is what shows most in pictures."""
        notes = list[str]()
        unsaid = [t for t in targets if not t.dictionary]
        if unsaid:
            named = {n: tuple(replace(t, dictionary=n) for t in unsaid) for n in COMMON_NAMES}
            name = max(named, key=lambda n: cls(named[n]).shown(pictures))
            notes.append(f"the tags are of {name}, as no dictionary is given")
            targets = [t if t.dictionary else replace(t, dictionary=name) for t in targets]
        even = [(t,) for t in targets if t.charuco is not None and t.charuco.squares[1] % 2 == 0]
        older = [t for t in even if not cls(t).shown(pictures) and cls(t, older=t).shown(pictures)]
        notes += [f"{t.text} as OpenCV before 4.6 printed it" for (t,) in older]
        return cls(tuple(targets), tuple(notes), older=tuple(t for (t,) in older))

    def find(self, picture: Picture) -> tuple[Corners, str]:
        """All corners in a picture, and the reason where there are none."""
        found = [np.zeros((0, 4)), *self.parts(picture)]
        return np.concatenate(found), "" if len(found) > 1 else self.reason(picture)

    def shown(self, pictures: Sequence[Picture]) -> int:
        """How many corners pictures show."""
        return sum(len(part) for picture in pictures for part in self.parts(picture))

    def parts(self, picture: Picture) -> Iterator[Corners]:
        """What a picture shows of each ChArUco board, and of all tags of a dictionary, if enough."""
        tags: dict[str, list[PictureTarget]] = {}
        for target in self.targets:
            if target.charuco is None:
                tags.setdefault(target.dictionary, []).append(target)
                continue
            board = opencv_board(target.charuco)
            board.setLegacyPattern(target in self.older)
            uv, names, *_ = opencv().aruco.CharucoDetector(board).detectBoard(picture)
            if names is not None and len(names) >= MIN_FOUND:
                ids = names.ravel() + target.ids[0]
                yield np.column_stack([ids, np.zeros(len(ids)), uv.reshape(-1, 2)])
        for dictionary, own in tags.items():
            squares, names = markers_in(picture, dictionary)
            ids, corners = np.repeat(names, 4), np.tile(np.arange(4), len(names))
            known = Rig((), tuple(own)).points_named(ids, corners) >= 0
            if known.sum() >= MIN_FOUND:
                yield np.column_stack([ids, corners, squares.reshape(-1, 2)])[known]

    def reason(self, picture: Picture) -> str:
        """Why a picture does not show the target."""
        stated = list(dict.fromkeys(target.dictionary for target in self.targets))
        shown = sum(len(markers_in(picture, name)[1]) for name in stated)
        if shown >= MIN_FOUND:
            return f"its markers are not those of {Rig((), self.targets).text}"
        others = [n for n in COMMON_NAMES if n not in stated and len(markers_in(picture, n)[1]) >= MIN_FOUND]
        more = f" and more of {others[0]}" if others else ": is it in view, sharp, lit, not mirrored?"
        return f"it shows {plural(shown, 'marker')} of {', '.join(stated)}{more}"


def picture_files(folder: Path, rig: Rig, named: Collection[str] = ()) -> Iterator[tuple[str, Path]]:
    """Name of the camera and path of every picture, in the order of their names: 2 before 10; of several with
    one stem the named one, if any is."""
    if not folder.is_dir():
        raise FileError("is not a folder of pictures", path=str(folder))
    names = [camera.name for camera in rig.cameras] or ["camera"]
    for name in names:
        own = folder if len(names) == 1 else folder / name
        inside = (own.iterdir(), own.rglob("*")) if own.is_dir() else ()
        pictures = ([p for p in some if p.suffix.lower() in PICTURES] for some in inside)
        every = (sorted(part, key=lambda p: (len(p.stem) * p.stem.isdigit(), p.name)) for part in pictures)
        found = next(filter(None, every), [])
        stems = {path.stem for path in found if path.name in named}  # of 0.jpg beside a depth 0.png
        found = [path for path in found if path.name in named or path.stem not in stems]
        if again := [file for file, count in Counter(path.name for path in found).items() if count > 1]:
            text = f"has '{again[0]}' in several folders; give every picture its own name"
            raise FileError(text, path=str(own))
        if not found:
            raise FileError(f"has no pictures ({', '.join(PICTURES[:4])} …)", path=str(own))
        yield from ((name, path) for path in found)


def read_picture(path: Path, size: tuple[int, int] | None = None) -> Picture:
    """A picture in grey as the sensor saw it; turned as its EXIF says only where `size` [px] then fits."""
    with contextlib.suppress(Exception):  # Pillow stumbles over each format in its own way
        picture: Image.Image = Image.open(io.BytesIO(read_bytes(path, wanted="a picture")))
        if 0 < picture.width * picture.height <= MAX_PIXELS:
            is_turned = size not in (None, picture.size) and size == picture.size[::-1]
            picture = ImageOps.exif_transpose(picture) if is_turned else picture
            if picture.mode.startswith("I"):  # 16 bits
                return (np.asarray(picture) // 256).astype(np.uint8)
            return np.asarray(picture.convert("L"))
    raise FileError(f"can't be read as a picture of at most {MAX_PIXELS // 10**6} megapixels", path=str(path))


def readable(files: list[tuple[str, Path]], sizes: Mapping[str, tuple[int, int] | None]) -> Iterator[Picture]:
    """Those of some pictures that can be read."""
    for camera, path in files:
        with contextlib.suppress(FileError):
            yield read_picture(path, sizes[camera])


def find_corners(folder: Path | str, rig: Rig, named: Collection[str] = ()) -> tuple[Fields, list[str]]:
    """Corners in all pictures of a folder, as a table has them, and the names of the pictures; with several
    cameras, of a folder each inside it, by their names.

    Args:
        folder: Of the pictures.
        rig: Cameras and target.
        named: Pictures that are meant of several with one stem.
    """
    folder = Path(folder)
    files = list(picture_files(folder, rig, named))
    sizes = {camera.name: camera.size for camera in rig.cameras}
    few = [files[i] for i in np.unique(np.linspace(0, len(files) - 1, 5).astype(int))]
    finder = BoardFinder.of(rig.targets, list(readable(few, sizes)))

    def look(entry: tuple[str, Path]) -> tuple[Corners, str]:
        camera, path = entry
        try:
            picture = read_picture(path, sizes[camera])
        except FileError as error:
            return np.zeros((0, 4)), str(error).removeprefix(f"{path}: ")
        if picture.shape[::-1] != sizes[camera]:
            has = f"the picture has {picture.shape[1]} x {picture.shape[0]} px, camera '{camera}' has size"
            raise DataError(f"{path}: {has} = {list(sizes[camera] or ())}; give the camera that took it")
        return finder.find(picture)

    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        found: list[tuple[Corners, str]] = []
        for (_, path), one in zip(files, pool.map(look, files), strict=True):
            progress(len(found) / len(files), f"looking for corners in {path.name}")
            found.append(one)
            if cancelled():
                pool.shutdown(wait=False, cancel_futures=True)
                raise Cancelled
    names = [path.name for _, path in files]
    size, every = [len(corners) for corners, _ in found], np.concatenate([corners for corners, _ in found])
    ids, corners = every[:, :2].astype(int).T
    without = [(name, reason) for name, (_, reason) in zip(names, found, strict=True) if reason]
    notes = tuple(_judged(folder, finder, ids, without, len(found)))
    labels = {"image": np.repeat(names, size), "camera": np.repeat([camera for camera, _ in files], size)}
    numbers = {"id": ids.astype(str), "corner": corners.astype(str), "u": every[:, 2], "v": every[:, 3]}
    values, lines = labels | numbers, tuple(range(len(every)))
    return Fields(source=str(folder), lines=lines, values=values, notes=notes), names


def _judged(
    folder: Path, finder: BoardFinder, seen: np.ndarray, without: list[tuple[str, str]], count: int
) -> Iterator[str]:
    """Notes on the pictures, of which some have none of the ids that were seen, for a reason."""
    if len(without) == count:
        reason, _ = Counter(reason for _, reason in without).most_common(1)[0]
        first = next(name for name, r in without if r == reason)
        raise DataError(f"{folder}: none of {count} pictures shows the target; '{first}': {reason}")
    yield f"{len(seen)} corners in {plural(count - len(without), 'picture')}"
    for reason in dict.fromkeys(reason for _, reason in without):
        own = [name for name, r in without if r == reason]
        yield f"{plural(len(own), 'picture')} left out, {listed(own, longest=3)}: {reason}"
    yield from finder.notes
    for board in finder.targets:
        if not np.isin(board.ids, seen).any():
            yield f"no picture shows board '{board.name}'"


PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0)}
"""Widths and heights of paper [mm]."""
BORDER = 8.0
"""Paper left white around [mm]."""
DOT = 0.05
"""Largest dot of the drawn board [mm]; corners of squares lie between dots, so that they are exact."""


def board_pdf(board: Charuco) -> tuple[bytes, str]:
    """A sheet with the board as PDF, the same for the same board, and what it is, in words."""
    page, (name, width, height) = printed_sheet(board)
    buffer, dpi = io.BytesIO(), (25.4 * page.width / width, 25.4 * page.height / height)
    (across, down), (side, marker) = board.squares, (1e3 * board.square, 1e3 * board.marker)
    squares = f"{across} × {down} squares of {side:g} mm, markers of {marker:g} mm"
    title = f"ChArUco, {squares}, {board.dictionary} {board.markers[0]} … {board.markers[-1]}"
    page.save(buffer, format="PDF", dpi=dpi, title=title, creationDate=None, modDate=None)
    return buffer.getvalue(), f"{title} on {name}; print it at 100 %, and measure a square"


def printed_sheet(board: Charuco) -> tuple[Image.Image, tuple[str, float, float]]:
    """The board on the smallest paper for it, no corner of a square rounded; the paper [mm]."""
    drawn, side = opencv_board(board), 1e3 * board.square
    size = [side * count for count in board.squares]
    papers = ((name, *p) for name, paper in PAPERS.items() for p in (paper, paper[::-1]))
    least = [length + 2 * BORDER for length in size]
    paper = next((p for p in papers if p[1] >= least[0] and p[2] >= least[1]), None)
    if paper is None:
        board_size = f"{size[0]:.0f} x {size[1]:.0f} mm is larger than A1 paper"
        raise OptionError(f"{board_size}; choose smaller or fewer squares")
    each = int(np.ceil(side / DOT))
    dots = Image.fromarray(drawn.generateImage(tuple(each * count for count in board.squares)))
    _, width, height = paper
    page = Image.new("1", (round(width * each / side), round(height * each / side)), 1)
    page.paste(dots, ((page.width - dots.width) // 2, (page.height - dots.height) // 2))
    return page, paper
