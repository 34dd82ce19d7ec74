"""PDF pages filled from the top with text, tables and pictures.

Lengths are in mm from the upper left corner. Words are broken by the width of their letters, so that nothing
runs out of the page.
"""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from matplotlib.figure import Figure, SubFigure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import FancyBboxPatch
from matplotlib.textpath import TextToPath

from workbench.report.figures import INK, look

WIDTH, HEIGHT, MARGIN = 210.0, 297.0, 16.0
"""An A4 sheet."""
QUIET = "#5d6672"
LINE_HEIGHT = 1.42
SAFE = 0.97
"""Part of the width that is filled: letters are wider where they are fitted to dots."""
_POINT = 25.4 / 72.0
_FONT = 20.0
"""Size at which letters are measured [points]."""


@cache
def _advance(text: str, bold: bool) -> float:
    """Width of a text [em]."""
    font = FontProperties(family="DejaVu Sans", weight="bold" if bold else "normal", size=_FONT)
    return TextToPath().get_text_width_height_descent(text, font, ismath=False)[0] / _FONT


def broken(text: str, width: float, size: float, *, bold: bool = False) -> list[str]:
    """Lines of a text no wider than so many mm, broken at blanks, and within words that are too long."""
    most = SAFE * width / (size * _POINT)
    blank = _advance("n n", bold) - _advance("nn", bold)
    lines: list[str] = []
    filled = most
    for word in " ".join(text.split()).replace(" %", "\u00a0%").split(" "):
        for piece in _pieces(word, most, bold):
            long = _advance(piece, bold)
            if filled + blank + long > most:
                lines.append(piece)
                filled = long
            else:
                lines[-1] += f" {piece}"
                filled += blank + long
    return lines


def _pieces(word: str, most: float, bold: bool) -> list[str]:
    """A word, or parts of it that are short enough."""
    if len(word) < 2 or _advance(word, bold) <= most:
        return [word]
    half = len(word) // 2
    return [*_pieces(word[:half], most, bold), *_pieces(word[half:], most, bold)]


@dataclass(frozen=True)
class Place:
    """A column of the page: from the left edge, so wide [mm]."""

    left: float = MARGIN
    width: float = WIDTH - 2.0 * MARGIN


WHOLE = Place()


class Paper:
    """One A4 page; `y` says how far down it is filled [mm]."""

    def __init__(self):
        with look():
            self.figure = Figure(figsize=(WIDTH / 25.4, HEIGHT / 25.4))
        self.y = MARGIN

    def words(
        self,
        text: str,
        *,
        size: float = 8.0,
        bold: bool = False,
        colour: str = INK,
        at: Place = WHOLE,
        most: int = 99,
    ) -> None:
        """A paragraph; beyond so many lines it is cut."""
        lines = broken(text, at.width, size, bold=bold)
        if len(lines) > most:
            lines = [*lines[: most - 1], f"{lines[most - 1].rstrip('. ')} …"]
        for line in lines:
            self.y += size * _POINT * LINE_HEIGHT
            self._text(line, at.left, self.y - 0.32 * size * _POINT, size=size, bold=bold, colour=colour)

    def pairs(self, rows: Sequence[tuple[str, str]], *, at: Place = WHOLE, label: float = 26.0) -> None:
        """Names on the left in quiet colour, what they are beside them."""
        for name, text in rows:
            top = self.y
            self.words(name, size=7.5, colour=QUIET, at=Place(at.left, label))
            low, self.y = self.y, top
            self.words(text, size=7.5, at=Place(at.left + label, at.width - label), most=3)
            self.y = max(low, self.y) + 0.5

    def table(
        self,
        head: Sequence[str],
        rows: Sequence[Sequence[str]],
        shares: Sequence[float],
        *,
        at: Place = WHOLE,
        size: float = 7.5,
    ) -> None:
        """Headings over a line, and rows; the first column on the left, the others on the right.

        Args:
            head: Headings.
            rows: Cells.
            shares: Part of the width of each column.
            at: Where it stands.
            size: Of the letters [points].
        """
        step = size * _POINT * 1.6
        rights = [at.left + at.width * sum(shares[: k + 1]) for k in range(len(shares))]
        for number, cells in enumerate((head, *rows)):
            self.y += step
            for k, cell in enumerate(cells):
                x, align = (at.left, "left") if k == 0 else (rights[k] - 1.0, "right")
                self._text(cell, x, self.y - 0.3 * step, size=size, bold=number == 0, align=align)
            if number == 0:
                self.rule(at=at, width=0.7)

    def rule(self, *, at: Place = WHOLE, width: float = 0.5, colour: str = INK) -> None:
        """A line across the column."""
        x, y = [at.left / WIDTH, (at.left + at.width) / WIDTH], [1.0 - self.y / HEIGHT] * 2
        self.figure.add_artist(Line2D(x, y, color=colour, linewidth=width))

    def badge(self, text: str, colour: str, *, at: Place) -> None:
        """A word in a coloured field, beside what is written next."""
        x, y, high = at.left / WIDTH, 1.0 - (self.y + 10.0) / HEIGHT, 9.0 / HEIGHT
        style = "round,pad=0,rounding_size=0.006"
        box = FancyBboxPatch(
            (x, y), at.width / WIDTH, high, boxstyle=style, color=colour, mutation_aspect=0.7
        )
        self.figure.add_artist(box)
        centre = at.left + 0.5 * at.width
        self._text(text, centre, self.y + 6.7, size=12.0, bold=True, colour="white", align="center")

    def picture(self, height: float) -> SubFigure:
        """Room for a picture of so many mm across the page."""
        with look():
            grid = self.figure.add_gridspec(
                3,
                3,
                width_ratios=[MARGIN, WIDTH - 2.0 * MARGIN, MARGIN],
                height_ratios=[self.y, height, HEIGHT - self.y - height],
                wspace=0.0,
                hspace=0.0,
            )
            self.y += height
            return self.figure.add_subfigure(grid[1, 1])

    def pdf(self) -> bytes:
        """The page as a PDF file, the same for the same content."""
        buffer = io.BytesIO()
        with look():
            self.figure.savefig(buffer, format="pdf", facecolor="white", metadata={"CreationDate": None})
        return buffer.getvalue()

    def _text(
        self,
        text: str,
        x: float,
        y: float,
        *,
        size: float,
        bold: bool = False,
        colour: str = INK,
        align: str = "left",
    ) -> None:
        weight = "bold" if bold else "normal"
        with look():
            self.figure.text(
                x / WIDTH,
                1.0 - y / HEIGHT,
                text,
                fontsize=size,
                fontweight=weight,
                color=colour,
                ha=align,
                va="baseline",
            )
