"""A ChArUco board to print."""

import numpy as np

from workbench.data.camera.markers import black_cells, opencv_board
from workbench.data.camera.printed import Sheet, marker_polygons
from workbench.data.camera.target import Charuco

MM = 1e3


def board_sheet(board: Charuco, *, legacy: bool = False) -> Sheet:
    """The board as a sheet; `legacy`: in the pattern of OpenCV before 4.6.

    Raises:
        OptionError: the dictionary is unknown or has too few markers.
    """
    drawn = opencv_board(board, legacy=legacy)
    across, down = board.squares
    side = MM * board.square
    box = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    white = {
        tuple(np.floor(np.asarray(points)[:, :2].mean(0) / board.square).astype(int).tolist())
        for points in drawn.getObjPoints()
    }
    black = [
        side * (box + np.array([x, y])) for y in range(down) for x in range(across) if (x, y) not in white
    ]
    for number, points in zip(drawn.getIds().ravel(), drawn.getObjPoints(), strict=True):
        black += marker_polygons(black_cells(board.dictionary, int(number)), MM * np.asarray(points)[:, :2])
    title = (
        f"ChArUco, {across} × {down} squares of {side:g} mm, markers of {MM * board.marker:g} mm, "
        f"{board.dictionary}"
    )
    return Sheet((across * side, down * side), black, title=title)
