"""Boards on paper: a sheet to print at its true size with a ruler."""

import io

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from workbench.base.errors import OptionError
from workbench.extras.camera.corner_detection import opencv_board
from workbench.extras.camera.target import Charuco

PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0)}
"""Widths and heights of paper [mm]."""
BORDER, FOOT = 8.0, 24.0
"""Paper left white around, and below for the ruler [mm]."""
RULER = 100.0
"""Length of the line by which the printer is checked [mm]."""
DOT = 0.05
"""Largest dot of the drawn board [mm]; corners of squares lie between dots, so that they are exact."""
LINE, TEXT = 0.2, 2.3
"""Width of the ruler's lines and height of the text [mm]."""


def fitting_marker(square: float) -> float:
    """Side of the markers in squares of this side [m]."""
    return round(0.75 * square, 4)


def across_down(text: str) -> tuple[int, int]:
    """Squares across and down from 5x7."""
    try:
        across, down = (int(part) for part in text.lower().replace("×", "x").split("x"))
    except ValueError:
        raise OptionError(f"squares must be like 5x7, got '{text}'") from None
    return across, down


def board_pdf(board: Charuco) -> tuple[bytes, str]:
    """A sheet with the board as PDF, the same for the same board, and what it is, in words."""
    page, (name, width, height), title = printed_sheet(board)
    buffer, dpi = io.BytesIO(), (25.4 * page.width / width, 25.4 * page.height / height)
    page.save(buffer, format="PDF", dpi=dpi, title=title, creationDate=None, modDate=None)
    return buffer.getvalue(), f"{title} on {name}"


def printed_sheet(board: Charuco) -> tuple[Image.Image, tuple[str, float, float], str]:
    """The board on the smallest paper for it, no corner of a square rounded; the paper [mm], a title."""
    across, down = board.squares
    side, marker = 1e3 * board.square, 1e3 * board.marker
    size = across * side, down * side
    title = (
        f"ChArUco, {across} × {down} squares of {side:g} mm, markers of {marker:g} mm, "
        f"{board.dictionary} {board.markers[0]} … {board.markers[-1]}"
    )
    drawn = opencv_board(board)
    papers = ((name, *p) for name, paper in PAPERS.items() for p in (paper, paper[::-1]))
    least = size[0] + 2 * BORDER, size[1] + BORDER + FOOT
    if (paper := next((p for p in papers if p[1] >= least[0] and p[2] >= least[1]), None)) is None:
        board_size = f"{size[0]:.0f} x {size[1]:.0f} mm is larger than A1 paper"
        raise OptionError(f"{board_size}; choose smaller or fewer squares")
    name, width, height = paper
    each = int(np.ceil(side / DOT))
    dots = Image.fromarray(drawn.generateImage((across * each, down * each)))
    scale = dots.width / size[0]
    page = Image.new("1", (round(width * scale), round(height * scale)), 1)
    left, top = 0.5 * (width - size[0]), 0.5 * (height - FOOT + BORDER - size[1])
    page.paste(dots, (round(left * scale), round(top * scale)))
    _ruler(ImageDraw.Draw(page), height - FOOT + 8.0, width, f"{title} · {name}", scale)
    return page, paper, title


def _ruler(draw: ImageDraw.ImageDraw, y: float, width: float, title: str, scale: float) -> None:
    """A line of known length with a tick every 10 mm, and what to do with it [mm; scale in dots/mm]."""
    ticks = 0.5 * (width - RULER) + np.linspace(0.0, RULER, 11)
    lines = [(ticks[0], y, ticks[-1], y), *((x, y - 2.0, x, y) for x in ticks)]
    for line in lines:
        draw.line([scale * along for along in line], fill=0, width=round(LINE * scale))
    note = (
        f'Print at 100 % ("actual size"). This line must be {RULER:.0f} mm long; if not, scale the lengths '
        "in target.toml accordingly."
    )
    font = ImageFont.load_default(TEXT * scale)
    for text, down in ((note, 3.5), (title, 7.5)):
        draw.text((0.5 * width * scale, (y + down) * scale), text, fill=0, font=font, anchor="mm")
