"""Sheets to print at their true size: a board as OpenCV draws it, and a ruler, as PDF and PNG."""

import io
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from workbench.base.errors import OptionError
from workbench.extras.camera.markers import opencv_board
from workbench.extras.camera.target import Charuco
from workbench.report.figures import look

PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0)}
"""Widths and heights of paper [mm]."""
BORDER, FOOT = 8.0, 24.0
"""Paper left white around, and below for the ruler [mm]."""
RULER = 100.0
"""Length of the line by which the printer is checked [mm]."""
DOT = 0.05
"""Largest dot of the drawn board [mm]; corners of squares lie between dots, so that they are exact."""
INK, QUIET = "black", "#5d6672"


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

    def figure(self) -> Figure:
        name, width, height = self.paper
        left, top = 0.5 * (width - self.size[0]), 0.5 * (height - FOOT + BORDER - self.size[1])
        with look():
            figure = Figure(figsize=(width / 25.4, height / 25.4), facecolor="white")
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
            extent = (left, left + self.size[0], top + self.size[1], top)
            axes.imshow(self.dots, cmap="gray", vmin=0, vmax=255, extent=extent)
            axes.set(xlim=(0.0, width), ylim=(height, 0.0))
            axes.axis("off")
            _ruler(axes, height - FOOT + 8.0, width, f"{self.title} · {name}")
        return figure

    def pdf(self) -> bytes:
        """The page as PDF, the same for the same content."""
        return self._file(format="pdf", dpi=25.4 / DOT, metadata={"CreationDate": None})

    def png(self, dots: float = 300.0) -> bytes:
        """The page as a picture of so many dots per inch, which it says of itself."""
        return self._file(format="png", dpi=dots)

    def _file(self, **options) -> bytes:
        buffer = io.BytesIO()
        with look():
            self.figure().savefig(buffer, facecolor="white", **options)
        return buffer.getvalue()


def _ruler(axes, y: float, width: float, title: str) -> None:
    """A line of known length with a tick every 10 mm, and what to do with it."""
    ticks = 0.5 * (width - RULER) + np.linspace(0.0, RULER, 11)
    axes.hlines(y, ticks[0], ticks[-1], colors=INK, linewidths=0.6)
    axes.vlines(ticks, y - np.where(np.arange(11) % 5, 1.8, 3.0), y, colors=INK, linewidths=0.6)
    words = (
        f'Print at 100 % ("actual size"). This line must be {RULER:.0f} mm long; if not, scale the lengths '
        "in target.toml by what it is."
    )
    for text, down, colour in ((words, 3.5, INK), (title, 7.5, QUIET)):
        axes.text(0.5 * width, y + down, text, fontsize=6.5, color=colour, ha="center", va="center")


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
