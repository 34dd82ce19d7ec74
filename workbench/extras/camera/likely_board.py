"""Which ChArUco board pictures show: its dictionary and how many squares it has, by where its markers lie."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import OptionError
from workbench.base.progress import check_cancelled
from workbench.extras.camera.markers import COMMON_NAMES, detector, opencv_board
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.picture_files import Picture
from workbench.extras.camera.target import Charuco

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


def markers_in(picture: Picture, dictionary: str) -> Markers:
    """The markers of a dictionary in a picture."""
    corners, names, _ = detector(dictionary).detectMarkers(picture)
    if names is None or not len(names):
        return np.zeros((0, 4, 2)), np.zeros(0, int)
    return np.array(corners, float).reshape(-1, 4, 2), np.asarray(names).ravel().astype(int)


def share_on_board(board: Any, squares: np.ndarray, names: np.ndarray) -> float:
    """Share of markers that lie as on a board seen from somewhere."""
    cv2 = opencv("reading pictures")
    pairs = zip(board.getIds().ravel(), board.getObjPoints(), strict=True)
    place = {int(m): np.asarray(points)[:, :2] for m, points in pairs}
    own = np.array([int(m) in place for m in names])
    if own.sum() < MIN_FOUND:
        return 0.0
    drawn = np.concatenate([place[int(m)] for m in names[own]])
    side = float(np.median(np.linalg.norm(np.diff(squares, axis=1), axis=2)))
    plane, near = cv2.findHomography(
        drawn, squares[own].reshape(-1, 2), cv2.RANSAC, ALONG * side, maxIters=RANSAC_RUNS
    )
    return 0.0 if plane is None else float(near.sum()) / (4 * len(names))


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
        if (across := likely_width(replace(board, dictionary=name), shown[:RICHEST])) is None:
            continue
        numbers, often = np.unique(np.concatenate([names for _, names in shown]), return_counts=True)
        last = int(numbers[often >= min(2, len(shown))].max(initial=0))
        down = _down(last, across)
        found = replace(board, squares=(across, down), dictionary=name)
        fit = _fit(found, *shown[0])
        down += fit.is_legacy and down % 2  # only boards of evenly many rows have that pattern
        return replace(found, squares=(across, down), marker=round(board.square * fit.side, 4))
    return None


def likely_width(board: Charuco, shown: Sequence[Markers]) -> int | None:
    """Squares across of the only board on which markers in pictures would lie as they do."""
    counted = [markers for markers in shown if len(markers[1]) >= MIN_COUNTED]
    fitting = {}
    for across in range(2, WIDEST + 1) if counted else ():
        share = float(np.mean([_fit(replace(board, squares=(across, 2)), *each).share for each in counted]))
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


def _fit(board: Charuco, squares: np.ndarray, names: np.ndarray) -> BoardFit:
    """The better of both patterns of a board that is as wide as this one, whatever its markers' size."""
    down = _down(int(names.max()), board.squares[0])
    wide = replace(board, squares=(board.squares[0], 2 * (down // 2 + 1)), first_marker=0)  # even: has both
    try:
        boards = [opencv_board(wide, legacy=legacy) for legacy in (False, True)]
    except OptionError:  # the dictionary is too small for it
        return BoardFit(0.0)
    return max(_fit_middles(each, board.square, squares, names) for each in boards)


def _fit_middles(board: Any, square: float, squares: np.ndarray, names: np.ndarray) -> BoardFit:
    cv2 = opencv("reading pictures")
    middles = np.array(board.getObjPoints())[:, :, :2].mean(1)[names] / square
    side = float(np.median(np.linalg.norm(np.diff(squares, axis=1), axis=2)))
    plane, near = cv2.findHomography(middles, squares.mean(1), cv2.RANSAC, ALONG * side, maxIters=RANSAC_RUNS)
    if plane is None or abs(np.linalg.det(plane)) < 1e-12:
        return BoardFit(0.0)
    flat = cv2.perspectiveTransform(squares.reshape(-1, 1, 2), np.linalg.inv(plane)).reshape(-1, 4, 2)
    own = float(np.median(np.linalg.norm(np.diff(flat, axis=1), axis=2)))
    if own >= 1.0:  # tags without squares between them
        return BoardFit(0.0)
    return BoardFit(float(near.mean()), own, board.getLegacyPattern())


def _down(last: int, across: int) -> int:
    """Fewest squares down of a board that has a marker of this number."""
    return int(np.ceil(2.0 * (last + 1) / across))
