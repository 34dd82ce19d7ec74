"""Markers of OpenCV's dictionaries, and boards of them."""

from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import OptionError
from workbench.extras.camera.camera import opencv
from workbench.extras.camera.picture_files import Picture
from workbench.extras.camera.target import Charuco

COMMON_NAMES = (
    *("DICT_6X6_250", "DICT_5X5_250", "DICT_4X4_250", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"),
    *("DICT_7X7_250", "DICT_6X6_1000", "DICT_5X5_1000", "DICT_4X4_1000", "DICT_7X7_1000"),
)
"""Dictionaries in which markers are sought where the right one shows none; the larger hold the smaller."""
MIN_FOUND = 4
"""Corners, or markers, that a picture must show."""

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


def has_markers_for(board: Charuco) -> bool:
    """Whether the board's dictionary has enough markers for it."""
    return board.markers.stop <= len(dictionary(board.dictionary).bytesList)


def opencv_board(board: Charuco, *, legacy: bool = False) -> Any:
    """A board as OpenCV has it; `legacy`: in the pattern of versions before 4.6, white square first."""
    across, down = board.squares
    if not has_markers_for(board):
        after = f" from {board.first_marker} on" if board.first_marker else ""
        raise OptionError(
            f"a board of {across} x {down} squares needs {len(board.markers)} markers{after}, "
            f"{board.dictionary} has fewer; choose a larger dictionary or fewer squares",
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
