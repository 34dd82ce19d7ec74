"""Boards on paper: a sheet to print at its true size."""

import io

import numpy as np
from PIL import Image

from workbench.base.errors import OptionError
from workbench.extras.camera.corner_detection import opencv_board
from workbench.extras.camera.target import Charuco

PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0)}
"""Widths and heights of paper [mm]."""
BORDER = 8.0
"""Paper left white around [mm]."""
DOT = 0.05
"""Largest dot of the drawn board [mm]; corners of squares lie between dots, so that they are exact."""


def across_down(text: str) -> tuple[int, int]:
    """Squares across and down from 5x7."""
    try:
        across, down = (int(part) for part in text.lower().replace("×", "x").split("x"))
    except ValueError:
        raise OptionError(f"squares must be like 5x7, got '{text}'") from None
    return across, down


def board_pdf(board: Charuco) -> tuple[bytes, str]:
    """A sheet with the board as PDF, the same for the same board, and what it is, in words."""
    page, (name, width, height) = printed_sheet(board)
    buffer, dpi = io.BytesIO(), (25.4 * page.width / width, 25.4 * page.height / height)
    (across, down), (side, marker) = board.squares, (1e3 * board.square, 1e3 * board.marker)
    title = (
        f"ChArUco, {across} × {down} squares of {side:g} mm, markers of {marker:g} mm, "
        f"{board.dictionary} {board.markers[0]} … {board.markers[-1]}"
    )
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
