"""Corners of boards and tags found in a folder of pictures.

A ChArUco board's inner corners are found beside its markers and refined to parts of a pixel; so are the
corners of single tags. Boards that OpenCV before 4.6 printed with an even number of rows have the other
pattern: whichever shows more corners is taken, and said. A picture without the target gets the reason.
"""

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import DataError, FileError
from workbench.base.progress import Cancelled, cancelled, progress
from workbench.base.wording import listed, plural
from workbench.extras.camera.likely_board import MIN_FOUND, RIGHT, likely_width, markers_in, share_on_board
from workbench.extras.camera.markers import COMMON_NAMES, opencv_board
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.picture_files import (
    Picture,
    blur,
    exif_note,
    picture_files,
    read_picture,
    readable,
)
from workbench.extras.camera.pixel_rows import PixelRows
from workbench.extras.camera.rig import Rig
from workbench.extras.camera.target import PictureTarget, prints_of

BLURRED = 1.4
"""Blur [px, standard deviation] from which on it is named: sharp pictures of small squares have up to 1.1."""


class Found(NamedTuple):
    """What one picture shows.

    Args:
        ids: Of tags, or of a board's corners.
        corners: Numbers of the tags' corners.
        uv: Where they are [px].
        reason: Why there is nothing; "" if there is something.
        strays: Markers that the board does not have.
    """

    ids: Int[np.ndarray, " n"]
    corners: Int[np.ndarray, " n"]
    uv: Float[np.ndarray, "n 2"]
    reason: str = ""
    strays: tuple[int, ...] = ()


NOTHING = Found(np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2)))


@dataclass(frozen=True, eq=False)
class Finder:
    """Finds one board, or tags, in pictures.

    Args:
        target: A board, or tags at known places.
        dictionary: Of the markers.
        legacy: Whether the board has the pattern of OpenCV before 4.6.
        others: Finders of the other boards.
    """

    target: PictureTarget
    dictionary: str
    legacy: bool = False
    others: tuple["Finder", ...] = ()

    @classmethod
    def of(cls, target: PictureTarget, pictures: Sequence[Picture] = ()) -> "Finder":
        """The finder of a target; a pattern or dictionary that nobody gave is what shows most in pictures."""
        if target.charuco is None:
            names = (target.dictionary,) if target.dictionary else COMMON_NAMES
            tried = [cls(target, name) for name in names]
        else:
            even = target.charuco.squares[1] % 2 == 0
            patterns = (False, True) if even else (False,)
            tried = [cls(target, target.charuco.dictionary, legacy) for legacy in patterns]
        if len(tried) == 1:
            return tried[0]
        shown = [sum(len(finder.seen(picture).ids) for picture in pictures) for finder in tried]
        return tried[int(np.argmax(shown))]

    @cached_property
    def foreign(self) -> set[int]:
        """Markers that look alike and are of other boards."""
        mine = prints_of(self.dictionary)
        alike = [f.target.markers for f in self.others if prints_of(f.dictionary) == mine]
        return set[int]().union(*alike) - self.target.markers

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided about the target."""
        if self.legacy:
            return ("the board has the pattern of OpenCV before 4.6 (setLegacyPattern)",)
        unsaid = self.target.charuco is None and not self.target.dictionary
        return (f"the tags are of {self.dictionary}, as no dictionary is given",) if unsaid else ()

    @cached_property
    def _board(self) -> Any:
        assert self.target.charuco is not None
        return opencv_board(self.target.charuco, legacy=self.legacy)

    def seen(self, picture: Picture) -> Found:
        """The target's corners in a picture, without a reason where there are none."""
        if self.target.charuco is None:
            squares, names = markers_in(picture, self.dictionary)
            own = np.isin(names, self.target.ids)
            ids, corners = np.repeat(names[own], 4), np.tile(np.arange(4), own.sum())
            known = self.target.places(ids, corners) >= 0
            return Found(ids[known], corners[known], squares[own].reshape(-1, 2)[known])
        cv2 = opencv("reading pictures")
        uv, names, _, markers = cv2.aruco.CharucoDetector(self._board).detectBoard(picture)
        expected = self.target.markers | self.foreign
        strays = () if markers is None else tuple(sorted({int(m) for m in markers.ravel()} - expected))
        if names is None or len(names) < MIN_FOUND:
            return NOTHING._replace(strays=strays)
        names = names.ravel().astype(int) + int(self.target.ids[0])
        return Found(names, np.zeros(len(names), int), uv.reshape(-1, 2).astype(float), strays=strays)

    def find(self, picture: Picture) -> Found:
        """The target's corners in a picture, or the reason why there are none."""
        found = self.seen(picture)
        return (
            found
            if len(found.ids) >= MIN_FOUND
            else NOTHING._replace(reason=self.reason(picture), strays=found.strays)
        )

    def reason(self, picture: Picture) -> str:
        """Why a picture does not show the target."""
        squares, names = markers_in(picture, self.dictionary)
        is_foreign = np.isin(names, list(self.foreign))
        squares, names = squares[~is_foreign], names[~is_foreign]
        board = self.target.charuco
        if (
            len(names) >= MIN_FOUND
            and board is not None
            and share_on_board(self._board, squares, names) < RIGHT
        ):
            across = likely_width(board, [(squares, names)])
            looks = f"; it looks like one {across} squares across" if across else ""
            size = "{} x {}".format(*board.squares)
            return f"its markers are not those of a board of {size} squares{looks}"
        if (
            len(names) == 0
            and len(markers_in(np.ascontiguousarray(picture[:, ::-1]), self.dictionary)[1]) >= 2
        ):
            return "it is mirrored: print the sheet, or take the picture, without mirroring"
        if BLURRED < (width := blur(picture)) < np.inf:
            return f"it is blurred by about {width:.1f} px: hold still, focus, or add light"
        if len(names):
            return f"it shows {plural(len(names), 'marker')}, too few: bring the whole target into view"
        if is_foreign.any():
            return "it shows no marker of this board"
        stated = {prints_of(f.dictionary) for f in self.others} - {prints_of(self.dictionary)}
        for other in (
            name for name in COMMON_NAMES if name != self.dictionary and prints_of(name) not in stated
        ):
            if len(markers_in(picture, other)[1]) >= MIN_FOUND:
                return f"its markers are of {other}, not of {self.dictionary}"
        return f"it shows no marker of {self.dictionary}"


@dataclass(frozen=True, eq=False)
class BoardFinder:
    """Finds all boards of a rig in pictures; tags of one dictionary are looked for at once.

    Args:
        finders: Of each ChArUco board, and of all tags of a dictionary.
        targets: The boards.
    """

    finders: tuple[Finder, ...]
    targets: tuple[PictureTarget, ...]

    @classmethod
    def of(cls, targets: Sequence[PictureTarget], pictures: Sequence[Picture] = ()) -> "BoardFinder":
        """The finder of targets; what nobody gave of them is what shows most in pictures."""
        tags: dict[str, list[PictureTarget]] = {}
        for target in (t for t in targets if t.charuco is None):
            tags.setdefault(target.dictionary, []).append(target)
        parts = [t for t in targets if t.charuco is not None]
        parts += [_together(each) for each in tags.values()]
        finders = [Finder.of(part, pictures) for part in parts]
        found = (replace(f, others=tuple(other for other in finders if other is not f)) for f in finders)
        return cls(tuple(found), tuple(targets))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided about the boards."""
        return tuple(dict.fromkeys(note for finder in self.finders for note in finder.notes))

    def find(self, picture: Picture) -> Found:
        """All corners in a picture, or the reason why there are none."""
        found = [finder.seen(picture) for finder in self.finders]
        seen = [f for f in found if len(f.ids) >= MIN_FOUND]
        strays = tuple(sorted(set[int]().union(*(f.strays for f in found))))
        if not seen:
            return NOTHING._replace(reason=self.reason(picture), strays=strays)
        ids, corners, uv = (np.concatenate([f[k] for f in seen]) for k in range(3))
        return Found(ids, corners, uv, strays=strays)

    def reason(self, picture: Picture) -> str:
        """Why a picture shows no board: board by board where that differs."""
        reasons = {f.target.name: f.reason(picture) for f in self.finders}
        if len(set(reasons.values())) == 1:
            return next(iter(reasons.values()))
        return "; ".join(f"board '{name}': {why}" for name, why in reasons.items())

    def alone(self, board: PictureTarget) -> Finder:
        """The finder of one board, tags of others among what is beside it."""
        shared = next(f for f in self.finders if np.isin(board.ids, f.target.ids).all())
        parts = [t for t in self.targets if t is not board and np.isin(t.ids, shared.target.ids).all()]
        beside = (replace(shared, target=part) for part in parts)
        return replace(shared, target=board, others=(*shared.others, *beside))


def find_corners(folder: Path | str, rig: Rig) -> PixelRows:
    """Corners in all pictures of a folder; with several cameras, of a folder each inside it, by their names.

    Args:
        folder: Of the pictures.
        rig: Cameras and target.
    """
    folder = Path(folder)
    files = list(picture_files(folder, rig))
    sizes = {camera.name: camera.size for camera in rig.cameras}
    finder = BoardFinder.of(rig.targets, list(readable(_some(files), sizes)))

    def look(entry: tuple[str, Path]) -> Found:
        camera, path = entry
        try:
            picture = read_picture(path, sizes[camera])
        except FileError as error:
            return NOTHING._replace(reason=str(error).removeprefix(f"{path}: "))
        if picture.shape[::-1] != sizes[camera]:
            raise DataError(
                f"{path}: the picture has {picture.shape[1]} x {picture.shape[0]} px, camera '{camera}' has "
                f"size = [{sizes[camera][0]}, {sizes[camera][1]}]; give the camera that took it"
            )
        return finder.find(picture)

    with ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
        found: list[Found] = []
        for (_, path), one in zip(files, pool.map(look, files), strict=True):
            progress(len(found) / len(files), f"looking for corners in {path.name}")
            found.append(one)
            if cancelled():
                pool.shutdown(wait=False, cancel_futures=True)
                raise Cancelled
    names = [path.name for _, path in files]
    notes = _judged(folder, finder, names, found)
    notes += (*_unseen(finder, found, _some(files)), *exif_note([path for _, path in files]))
    width = np.median([blur(picture) for picture in readable(_some(files), sizes)])
    if BLURRED < width < np.inf:
        notes += (f"the pictures are blurred by about {width:.1f} px: hold still, focus, or add light",)
    size = [len(f.ids) for f in found]
    return PixelRows(
        image=np.repeat(names, size),
        camera=np.repeat([camera for camera, _ in files], size),
        id=np.concatenate([f.ids for f in found]),
        corner=np.concatenate([f.corners for f in found]),
        uv=np.concatenate([f.uv for f in found]),
        pictures=tuple(names),
        source=str(folder),
        notes=notes,
    )


def _judged(folder: Path, finder: BoardFinder, names: list[str], found: list[Found]) -> tuple[str, ...]:
    """Notes on the pictures."""
    without = [(name, f.reason) for name, f in zip(names, found, strict=True) if f.reason]
    boards = [f.target.charuco for f in finder.finders if f.target.charuco is not None]
    larger = [f for f in found if len(f.strays) > 1]
    if len(larger) > 0.5 * len(found):
        maximum = max(max(f.strays) for f in larger)
        sizes = ", ".join(
            "a board of {} x {} squares has markers {} … {}".format(*b.squares, b.markers[0], b.markers[-1])
            for b in boards
        )
        raise DataError(
            f"{folder}: the pictures show marker {maximum}, {sizes}; give the board that was in view"
        )
    if len(without) == len(found):
        reason, times = Counter(reason for _, reason in without).most_common(1)[0]
        first = next(name for name, r in without if r == reason)
        raise DataError(f"{folder}: none of {len(found)} pictures shows the target; '{first}': {reason}")
    corners = sum(len(f.ids) for f in found)
    notes = [f"{corners} corners in {plural(len(found) - len(without), 'picture')}"]
    for reason, times in Counter(reason for _, reason in without).items():
        own = [name for name, r in without if r == reason]
        notes.append(f"{plural(times, 'picture')} left out, {listed(own, longest=3)}: {reason}")
    return (*notes, *finder.notes)


def _unseen(finder: BoardFinder, found: list[Found], files: list[tuple[str, Path]]) -> Iterator[str]:
    """A sentence on every board that no picture shows, with the reason in a few of them."""
    seen = np.concatenate([f.ids for f in found])
    for board in finder.targets:
        if not np.isin(board.ids, seen).any():
            alone = finder.alone(board)
            sizes = dict.fromkeys((camera for camera, _ in files), None)
            why = Counter(map(alone.reason, readable(files, sizes))).most_common(1)[0][0]
            yield f"no picture shows board '{board.name}': {why}"


def _together(targets: Sequence[PictureTarget]) -> PictureTarget:
    """Tags of several boards as if they were of one, to be looked for at once."""
    ids, corners, points = (
        np.concatenate([getattr(t, k) for t in targets]) for k in ("ids", "corners", "points")
    )
    name = ", ".join(t.name for t in targets)
    return replace(targets[0], name=name, ids=ids, corners=corners, points=points)


def _some(files: list) -> list:
    """A few of the files, from all over."""
    return [files[i] for i in np.unique(np.linspace(0, len(files) - 1, 5).astype(int))]
