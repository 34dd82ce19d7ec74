"""Markers of OpenCV's dictionaries, boards of them, and which ChArUco board pictures show.

A board's dictionary and how many squares it has are told by where its markers lie.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import OptionError
from workbench.base.progress import check_cancelled
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.picture_files import Picture
from workbench.extras.camera.target import Charuco

COMMON_NAMES = (
    *("DICT_6X6_250", "DICT_5X5_250", "DICT_4X4_250", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"),
    *("DICT_7X7_250", "DICT_6X6_1000", "DICT_5X5_1000", "DICT_4X4_1000", "DICT_7X7_1000"),
)
"""Dictionaries in which markers are sought where the right one shows none; the larger hold the smaller."""
MIN_FOUND = 4
"""Corners, or markers, that a picture must show."""
ALONG = 0.3
"""Part of a marker's side by which a marker may miss its place on a board that is the right one …"""
RIGHT = 0.8
"""… and the share of markers that must not."""
RANSAC_RUNS = 100
"""Samples of RANSAC: with `RIGHT` of the corners in place, all of them miss with odds of 1e-23."""
WIDEST = 24
"""Squares across that are tried."""
MIN_COUNTED, MARGIN = 6, 0.1
"""Markers from which squares are counted, and the share by which all other widths have to fit worse."""
RICHEST = 4
"""Pictures of the most markers, in which squares are counted."""

Markers = tuple[Float[np.ndarray, "n 4 2"], Int[np.ndarray, " n"]]
"""Corners [px] and numbers of single markers."""


@cache
def dictionary(name: str) -> Any:
    number = getattr(opencv().aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        raise OptionError(
            f"unknown marker dictionary '{name}'; use one such as {', '.join(COMMON_NAMES[:4])}"
        )
    return opencv().aruco.getPredefinedDictionary(number)


def opencv_board(board: Charuco, *, legacy: bool = False) -> Any:
    """A board as OpenCV has it; `legacy`: in the pattern of versions before 4.6, white square first."""
    across, down = board.squares
    known = len(dictionary(board.dictionary).bytesList)
    if board.markers.stop > known:
        after = f" from {board.first_marker} on" if board.first_marker else ""
        raise OptionError(
            f"a board of {across} x {down} squares needs {len(board.markers)} markers{after}, "
            f"{board.dictionary} has {known}; choose a larger dictionary or fewer squares",
            option="dictionary",
            found=board.dictionary,
        )
    prints, own = dictionary(board.dictionary), np.array(board.markers)
    found = opencv().aruco.CharucoBoard(board.squares, board.square, board.marker, prints, own)
    found.setLegacyPattern(legacy)
    return found


def markers_in(picture: Picture, name: str) -> Markers:
    """The markers of a dictionary in a picture, their corners to parts of a pixel."""
    settings = opencv().aruco.DetectorParameters()
    settings.cornerRefinementMethod = opencv().aruco.CORNER_REFINE_SUBPIX
    corners, names, _ = opencv().aruco.ArucoDetector(dictionary(name), settings).detectMarkers(picture)
    if names is None or not len(names):
        return np.zeros((0, 4, 2)), np.zeros(0, int)
    return np.array(corners, float).reshape(-1, 4, 2), np.asarray(names).ravel().astype(int)


def likely_board(board: Charuco, pictures: Sequence[Picture]) -> Charuco | None:
    """The board of pictures whose squares have the sides of this one; None where it can't be told.

    Squares down reach as far as the last marker that two pictures show, or the only one.
    """
    for name in dict.fromkeys((board.dictionary, *COMMON_NAMES)):
        shown = []
        for picture in pictures:
            check_cancelled()
            shown.append(markers_in(picture, name))
        shown = sorted((markers for markers in shown if len(markers[1])), key=lambda own: -len(own[1]))
        if (across := _likely_width(replace(board, dictionary=name), shown[:RICHEST])) is None:
            continue
        numbers, often = np.unique(np.concatenate([names for _, names in shown]), return_counts=True)
        last = int(numbers[often >= min(2, len(shown))].max(initial=0))
        down = _down(last, across)
        found = replace(board, squares=(across, down), dictionary=name)
        fit = BoardFit.best(found, *shown[0])
        down += fit.is_legacy and down % 2  # only boards of evenly many rows have that pattern
        return replace(found, squares=(across, down), marker=round(board.square * fit.side, 4))
    return None


def _likely_width(board: Charuco, shown: Sequence[Markers]) -> int | None:
    """Squares across of the only board on which markers in pictures would lie as they do."""
    counted = [markers for markers in shown if len(markers[1]) >= MIN_COUNTED]
    fitting = {}
    for across in range(2, WIDEST + 1) if counted else ():
        wide = replace(board, squares=(across, 2))
        share = float(np.mean([BoardFit.best(wide, *each).share for each in counted]))
        if share > RIGHT:
            fitting[across] = share
    best = max(fitting.values(), default=0.0)
    likely = [across for across, share in fitting.items() if share > best - MARGIN]
    return likely[0] if len(likely) == 1 else None


class BoardFit(NamedTuple):
    """How markers in a picture go with a board.

    Args:
        share: Of them whose middles lie as on the board.
        side: Of a marker, in squares.
        is_legacy: Whether the board has the pattern of OpenCV before 4.6, white square first.
    """

    share: float
    side: float = 0.0
    is_legacy: bool = False

    @classmethod
    def best(cls, board: Charuco, squares: np.ndarray, names: np.ndarray) -> "BoardFit":
        """Of both patterns of a board that is as wide as this one, whatever its markers' size."""
        across = board.squares[0]
        down = _down(int(names.max()), across)
        wide = replace(board, squares=(across, 2 * (down // 2 + 1)), first_marker=0)  # even: has both
        cv2, found = opencv(), [cls(0.0)]
        limit = ALONG * float(np.median(np.linalg.norm(np.diff(squares, axis=1), axis=2)))
        for is_legacy in (False, True):
            try:
                places = np.array(opencv_board(wide, legacy=is_legacy).getObjPoints())
            except OptionError:  # the dictionary is too small for it
                break
            middles = places[:, :, :2].mean(1)[names] / board.square
            plane, near = cv2.findHomography(
                middles, squares.mean(1), cv2.RANSAC, limit, maxIters=RANSAC_RUNS
            )
            if plane is None or abs(np.linalg.det(plane)) < 1e-12:
                continue
            flat = cv2.perspectiveTransform(squares.reshape(-1, 1, 2), np.linalg.inv(plane))
            side = float(np.median(np.linalg.norm(np.diff(flat.reshape(-1, 4, 2), axis=1), axis=2)))
            if side < 1.0:  # else tags without squares between them
                found.append(cls(float(near.mean()), side, is_legacy))
        return max(found)


def _down(last: int, across: int) -> int:
    """Fewest squares down of a board that has a marker of this number."""
    return int(np.ceil(2.0 * (last + 1) / across))
