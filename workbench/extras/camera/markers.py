"""Markers of OpenCV's dictionaries and boards, and the detectors for them."""

from functools import cache
from typing import Any

import numpy as np

from workbench.base.errors import OptionError
from workbench.extras.camera.opencv import opencv
from workbench.extras.camera.target import Charuco

COMMON_NAMES = (
    *("DICT_6X6_250", "DICT_5X5_250", "DICT_4X4_250", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"),
    *("DICT_7X7_250", "DICT_6X6_1000", "DICT_5X5_1000", "DICT_4X4_1000", "DICT_7X7_1000"),
)
"""Dictionaries in which markers are sought where the right one shows none; the larger hold the smaller."""


@cache
def dictionary(name: str) -> Any:
    cv2 = opencv("reading and printing markers")
    number = getattr(cv2.aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        raise OptionError(
            f"unknown marker dictionary '{name}'; use one such as {', '.join(COMMON_NAMES[:4])}"
        )
    return cv2.aruco.getPredefinedDictionary(number)


def detector(name: str) -> Any:
    """Finds single markers of a dictionary, their corners to parts of a pixel."""
    cv2 = opencv("reading pictures")
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(dictionary(name), settings)


def opencv_board(board: Charuco, *, legacy: bool = False) -> Any:
    """A board as OpenCV has it; `legacy`: in the pattern of versions before 4.6, white square first."""
    across, down = board.squares
    known = len(dictionary(board.dictionary).bytesList)
    if board.markers.stop > known:
        after = f" from {board.first_marker} on" if board.first_marker else ""
        raise OptionError(
            f"a board of {across} x {down} squares needs {len(board.markers)} markers{after}, "
            f"{board.dictionary} has {known}; choose a larger dictionary or fewer squares"
        )
    cv2 = opencv("reading and printing boards")
    own = np.array(board.markers), dictionary(board.dictionary)
    found = cv2.aruco.CharucoBoard(board.squares, board.square, board.marker, own[1], own[0])
    found.setLegacyPattern(legacy)
    return found
