"""Sheets to print at their true size: black areas, lines and words in mm, as PDF and PNG."""

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from workbench.base.errors import OptionError
from workbench.data.camera.markers import black_cells, opencv_board
from workbench.data.camera.target import Charuco
from workbench.report.figures import look

PAPERS = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "A2": (420.0, 594.0), "A1": (594.0, 841.0)}
"""Widths and heights of paper [mm]."""
BORDER, FOOT = 8.0, 24.0
"""Paper left white around, and below for the ruler [mm]."""
RULER = 100.0
"""Length of the line by which the printer is checked [mm]."""
FOLD, INK, QUIET = "#b0b6bd", "black", "#5d6672"


@dataclass(frozen=True, eq=False)
class Sheet:
    """What is printed, from the upper left corner of its own area, y down [mm].

    Args:
        size: Width and height of that area.
        black: Polygons.
        folds: Lines to fold along, from and to.
        cuts: Lines to cut along.
        labels: Small words and where they stand.
        title: What it is.
    """

    size: tuple[float, float]
    black: Sequence[Float[np.ndarray, "corners 2"]]
    folds: Sequence[Float[np.ndarray, "2 2"]] = ()
    cuts: Sequence[Float[np.ndarray, "2 2"]] = ()
    labels: Sequence[tuple[tuple[float, float], str]] = ()
    title: str = ""

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
        """The page."""
        name, width, height = self.paper
        left = 0.5 * (width - self.size[0])
        top = 0.5 * (height - FOOT + BORDER - self.size[1])
        with look():
            figure = Figure(figsize=(width / 25.4, height / 25.4), facecolor="white")
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
            axes.set(xlim=(0.0, width), ylim=(height, 0.0))
            axes.axis("off")
            shift = np.array([left, top])
            black = [polygon + shift for polygon in self.black]
            axes.add_collection(PolyCollection(black, facecolor=INK, linewidth=0, snap=False))
            for lines, style, colour in ((self.folds, "--", FOLD), (self.cuts, "-", FOLD)):
                shown = [line + shift for line in lines]
                axes.add_collection(LineCollection(shown, colors=colour, linewidths=0.5, linestyles=style))
            for (x, y), text in self.labels:
                axes.text(x + left, y + top, text, fontsize=5.5, color=QUIET, ha="center", va="center")
            _ruler(axes, height - FOOT + 8.0, width, f"{self.title} · {name}")
        return figure

    def pdf(self) -> bytes:
        """The page as PDF, the same for the same content."""
        return self._file(format="pdf", metadata={"CreationDate": None})

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
    left = 0.5 * (width - RULER)
    ticks = np.linspace(left, left + RULER, 11)
    lines = [np.array([[left, y], [left + RULER, y]])]
    lines += [np.array([[x, y - (3.0 if k % 5 == 0 else 1.8)], [x, y]]) for k, x in enumerate(ticks)]
    axes.add_collection(LineCollection(lines, colors=INK, linewidths=0.6))
    words = (
        f'Print at 100 % ("actual size"). This line must be {RULER:.0f} mm long; if not, scale the lengths '
        "in target.toml by what it is."
    )
    for text, down, colour in ((words, 3.5, INK), (title, 7.5, QUIET)):
        axes.text(0.5 * width, y + down, text, fontsize=6.5, color=colour, ha="center", va="center")


def marker_polygons(
    cells: np.ndarray, corners: Float[np.ndarray, "4 2"]
) -> list[Float[np.ndarray, "corners 2"]]:
    """Black areas of a marker between its corners (upper left, upper right, lower right, lower left).

    Neighbours in a row are one area, and more areas cover the seams between rows, which would show.
    """
    side = len(cells)
    origin, right, down = corners[0], (corners[1] - corners[0]) / side, (corners[3] - corners[0]) / side
    boxes = [(begin, float(i), end, i + 1.0) for i, row in enumerate(cells) for begin, end in _runs(row)]
    seams = cells[:-1] & cells[1:]
    boxes += [(begin, i + 0.8, end, i + 1.2) for i, row in enumerate(seams) for begin, end in _runs(row)]
    found = []
    for left, top, end, low in boxes:
        box = np.array([[left, top], [end, top], [end, low], [left, low]], float)
        found.append(origin + box[:, :1] * right + box[:, 1:] * down)
    return found


def _runs(row: np.ndarray) -> list[list[int]]:
    """Where neighbouring black cells begin and end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
    return edges.reshape(-1, 2).tolist()


MM = 1e3


def board_sheet(board: Charuco, *, legacy: bool = False) -> Sheet:
    """The board as a sheet; `legacy`: in the pattern of OpenCV before 4.6."""
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
        f"{board.dictionary} {board.markers[0]} … {board.markers[-1]}"
    )
    return Sheet((across * side, down * side), black, title=title)
