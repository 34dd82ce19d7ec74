"""Sheets to print at their true size: a board as OpenCV draws it, and a ruler, as PDF and PNG."""

import io
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from workbench.base.errors import OptionError
from workbench.extras.camera.markers import opencv_board
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


@dataclass(frozen=True, eq=False)
class PrintedSheet:
    """What is printed.

    Args:
        size: Width and height of the board [mm].
        dots: It, as grey values.
        title: What it is.
    """

    size: tuple[float, float]
    dots: np.ndarray
    title: str

    @property
    def paper(self) -> tuple[str, float, float]:
        """Name, width and height of the smallest paper that holds it, upright or lying."""
        for name, (narrow, wide) in PAPERS.items():
            for width, height in ((narrow, wide), (wide, narrow)):
                if self.size[0] + 2 * BORDER <= width and self.size[1] + BORDER + FOOT <= height:
                    return name, width, height
        raise OptionError(
            f"{self.size[0]:.0f} x {self.size[1]:.0f} mm is larger than A1 paper; choose smaller or fewer "
            "squares"
        )

    def page(self) -> Image.Image:
        """The page in black and white, in the dots of the board: no corner of a square is rounded."""
        name, width, height = self.paper
        scale = self.dots.shape[1] / self.size[0]
        page = Image.new("1", (round(width * scale), round(height * scale)), 1)
        left, top = 0.5 * (width - self.size[0]), 0.5 * (height - FOOT + BORDER - self.size[1])
        page.paste(Image.fromarray(self.dots), (round(left * scale), round(top * scale)))
        _ruler(ImageDraw.Draw(page), height - FOOT + 8.0, width, f"{self.title} · {name}", scale)
        return page

    def pdf(self) -> bytes:
        """The page as PDF, the same for the same content."""
        page, buffer = self.page(), io.BytesIO()
        dpi = (25.4 * page.width / self.paper[1], 25.4 * page.height / self.paper[2])
        page.save(buffer, format="PDF", dpi=dpi, title=self.title, creationDate=None, modDate=None)
        return buffer.getvalue()

    def png(self, dots: float = 300.0) -> bytes:
        """The page as a picture of so many dots per inch, which it says of itself."""
        page, buffer = self.page(), io.BytesIO()
        step = dots / 25.4 * self.paper[1] / page.width
        width, height = int(page.width * step), int(page.height * step)
        page = page.convert("L").resize(
            (width, height), Image.Resampling.BOX, box=(0.0, 0.0, width / step, height / step)
        )
        page.save(buffer, format="PNG", dpi=(dots, dots))
        return buffer.getvalue()


def _ruler(draw: ImageDraw.ImageDraw, y: float, width: float, title: str, scale: float) -> None:
    """A line of known length with a tick every 10 mm, and what to do with it [mm; scale in dots/mm]."""
    from matplotlib.font_manager import findfont  # a quarter of a second, for which the page has no use

    ticks = 0.5 * (width - RULER) + np.linspace(0.0, RULER, 11)
    lines = [(ticks[0], y, ticks[-1], y)]
    lines += [(x, y - (1.8 if k % 5 else 3.0), x, y) for k, x in enumerate(ticks)]
    for line in lines:
        draw.line([scale * along for along in line], fill=0, width=round(LINE * scale))
    note = (
        f'Print at 100 % ("actual size"). This line must be {RULER:.0f} mm long; if not, scale the lengths '
        "in target.toml accordingly."
    )
    font = ImageFont.truetype(findfont("DejaVu Sans"), TEXT * scale)
    for text, down in ((note, 3.5), (title, 7.5)):
        draw.text((0.5 * width * scale, (y + down) * scale), text, fill=0, font=font, anchor="mm")


def board_sheet(board: Charuco, *, legacy: bool = False) -> PrintedSheet:
    """The board as a sheet; `legacy`: in the pattern of OpenCV before 4.6."""
    drawn, (across, down) = opencv_board(board, legacy=legacy), board.squares
    side, marker = 1e3 * board.square, 1e3 * board.marker
    size = (across * side, down * side)
    title = (
        f"ChArUco, {across} × {down} squares of {side:g} mm, markers of {marker:g} mm, "
        f"{board.dictionary} {board.markers[0]} … {board.markers[-1]}"
    )
    sheet = PrintedSheet(size, np.zeros((0, 0)), title)
    assert sheet.paper, "what is too large is refused before it is drawn"
    each = int(np.ceil(side / DOT))
    return PrintedSheet(size, drawn.generateImage((across * each, down * each)), title)
