"""Common elements of drawing pages: border, title block, tables, and hole callouts."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import isotonic_regression

from workbench.plate.parts.drawing import PAPERS, TEXT, Item, Layer, Line, Page, Words
from workbench.plate.parts.parts import Bore, Fixture, Purpose
from workbench.plate.tolerances import Tolerances

MM = 1e3
BORDER = 10.0
TITLE = (180.0, 36.0)
"""Width and height of the title block [mm]."""
LINE = 1.7 * TEXT
BOTTOM = "EN AW-5083"
STEEL = "C45"
RADIAL = 0.01
"""± of an index hole's distance from the seat [mm]."""
UPRIGHT = 0.005
"""How far a seat or an index hole may lean over its depth [mm]."""
FLAT = 1e-6
"""A face that slopes less has no low side [rad]."""
SHORT_OF = 2.0
"""Threads and screws end so far above the bottom of their hole [mm]."""
SCREWS = (8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
"""Lengths in which ISO 4762 and ISO 4026 sell M6 and M8 [mm]."""
DOWELS = (10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 24.0, 28.0, 32.0, 36.0, 40.0)
"""Lengths in which ISO 8734 sells Ø4 [mm]."""
LENGTH = 0.02
"""± of the probe's length, which is the tool's [mm]."""
PIN_PLACE = 0.01
"""Diameter in which the probe's pins lie [mm]."""
Rows = Sequence[Sequence[str]]


def sheet(page: Page, number: int, count: int) -> list[Item]:
    """Border and the page's number."""
    width, height = PAPERS[page.paper]
    corners = np.array([[BORDER, BORDER], [width - BORDER, height - BORDER]])
    (x0, y0), (x1, y1) = corners
    frame = Line(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]), Layer.FRAME, closed=True)
    words = Words(f"sheet {number} of {count}", np.array([x1 - 3.0, y0 + 2.5]), TEXT, "right")
    return [frame, words]


def title(paper: str, rows: Sequence[str]) -> list[Item]:
    """The title block: the part's name in large letters, then lines."""
    width, _ = PAPERS[paper]
    x, y = width - BORDER - TITLE[0], BORDER
    box = np.array([[x, y], [x + TITLE[0], y], [x + TITLE[0], y + TITLE[1]], [x, y + TITLE[1]]])
    items: list[Item] = [Line(box, Layer.FRAME, closed=True)]
    items.append(Words(rows[0], np.array([x + 3.0, y + TITLE[1] - 6.0]), 1.5 * TEXT))
    for i, row in enumerate(rows[1:], start=1):
        items.append(Words(row, np.array([x + 3.0, y + TITLE[1] - 6.0 - 5.2 * i]), TEXT))
    return items


def table(rows: Rows, at: np.ndarray, widths: Sequence[float]) -> list[Item]:
    """Rows of words, the first one underlined."""
    items: list[Item] = []
    for i, row in enumerate(rows):
        left = at[0]
        for cell, width in zip(row, widths, strict=True):
            items.append(Words(cell, np.array([left, at[1] - LINE * (i + 1)])))
            left += width
    under = at[1] - LINE - 0.8
    items.append(Line(np.array([[at[0], under], [at[0] + sum(widths), under]]), Layer.FRAME))
    return items


def lines(rows: Sequence[str], at: np.ndarray) -> list[Item]:
    """Lines of words under a point."""
    return [Words(row, at - [0.0, LINE * (i + 1)]) for i, row in enumerate(rows)]


def millimetres(value: float) -> str:
    """A length in metres as a number of millimetres."""
    return f"{MM * value:z.3f}"


SHORT = {
    Purpose.SCREW: "screw",
    Purpose.THREAD: "screw",
    Purpose.DOWEL: "dowel",
    Purpose.MOUNTING: "mounting",
    Purpose.SEAT: "probe seat",
    Purpose.INDEX: "index pin",
    Purpose.SOCKET: "ball",
    Purpose.TIP: "pointed probe",
    Purpose.MAGNET: "magnet",
    Purpose.PIN: "dowel pin",
    Purpose.FLANGE: "flange screw",
    Purpose.STANDOFF: "stand-off",
    Purpose.ROBOT: "robot's foot",
}


def position_words(bore: Bore, tolerances: Tolerances) -> str:
    """Position tolerance of a bore, with its datums."""
    across = 2.0 * MM * tolerances.place
    match bore.purpose:
        case Purpose.SEAT | Purpose.SOCKET | Purpose.TIP:
            return f"Ø{across:.3f} to A B C"
        case Purpose.INDEX:
            return f"by angle; radius ±{RADIAL:g}"
        case Purpose.DOWEL:
            return f"Ø{MM * tolerances.pair:.3f} to each other"
        case Purpose.PIN:
            return f"Ø{PIN_PLACE:g} to the axis"
    return f"Ø{max(across, 0.2):.3g}"


def thread_notes(bores: Sequence[Bore]) -> list[str]:
    """How deep threads are cut, where there are any."""
    if not any(bore.size.startswith("M") and not bore.through for bore in bores):
        return []
    return [f"Depth of a thread: its core's; the thread ends {SHORT_OF:g} above the bottom."]


def longest(sold: Sequence[float], room: float) -> float:
    """The longest one sold that has room, or the shortest [mm]."""
    return max((length for length in sold if length <= room + 1e-6), default=min(sold))


def dowel_length(fixture: Fixture) -> float:
    """Length of the pins through the plate into a block [mm]."""
    return longest(DOWELS, MM * (fixture.slab.size[2] + fixture.stock.dowel_depth))


def spread(values: np.ndarray, spacing: float) -> list[tuple[float, float]]:
    """Different values in order, each with a place for its label; labels keep their distance."""
    unique = np.unique(np.round(values, 5))
    ranks = spacing * np.arange(len(unique))
    # labels nearest to their values with the distance kept: the isotonic fit of value − rank · spacing
    fitted = isotonic_regression(unique - ranks).x + ranks
    return list(zip(unique.tolist(), fitted.tolist(), strict=True))
