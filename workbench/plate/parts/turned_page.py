"""The page of a turned part: from the side, and its end."""

import numpy as np

from workbench.plate.parts.drawing import PAPERS, TEXT, Circle, Item, Layer, Page, View, Words, paper_for
from workbench.plate.parts.page_parts import (
    BORDER,
    LINE,
    MM,
    SHORT,
    STEEL,
    lines,
    millimetres,
    position_words,
    table,
    title,
)
from workbench.plate.parts.parts import Bore, Fixture, Purpose, Turned
from workbench.plate.parts.tolerances import GENERAL


def turned_page(fixture: Fixture, part: Turned) -> Page:
    """Side view and end view."""
    widest = MM * max(diameter for diameter, _ in part.steps)
    paper, scale = paper_for(2.0 * widest, MM * part.length, (230.0, 70.0))
    _, top = PAPERS[paper]
    side = View(
        np.array([BORDER + 40.0 + 0.5 * widest / scale, top - BORDER - 30.0 - MM * part.length / scale]),
        scale,
    )
    end = View(side.origin + np.array([widest / scale + 40.0, 0.5 * MM * part.length / scale]), scale)
    items: list[Item] = []
    z = 0.0
    for i, (diameter, length) in enumerate(part.steps):
        radius, high = 0.5 * MM * diameter, MM * length
        items.append(side.line([(-radius, z), (radius, z), (radius, z + high), (-radius, z + high)]))
        items.append(Circle(end.origin, radius / scale, Layer.OUTLINE))
        items.append(side.across((-radius, z), (radius, z), (0.0, -10.0 - 8.0 * i), 0.0, "Ø<>"))
        if len(part.steps) > 1:
            items.append(
                side.across((radius, z), (radius, z + high), (0.5 * widest / scale + 8.0, 0.0), 90.0)
            )
        z += high
    items.append(side.across((0.0, 0.0), (0.0, z), (-0.5 * widest / scale - 10.0, 0.0), 90.0))
    items.append(side.line([(0.0, -4.0), (0.0, z + 4.0)], Layer.CENTRES, closed=False))
    there: dict[tuple[float, float], list[Bore]] = {}
    rows = [("hole", "for", "x", "y", "size", "depth", "position")]
    for bore in part.bores:
        x, y = MM * bore.mouth[:2]
        across = 0.5 * MM * bore.diameter
        ends = MM * np.array([bore.mouth[2], bore.bottom[2]])
        items.append(
            side.line(
                [(x - across, ends[0]), (x + across, ends[0]), (x + across, ends[1]), (x - across, ends[1])],
                Layer.HIDDEN,
            )
        )
        items += end.hole((x, y), 2.0 * across)
        there.setdefault((round(x, 6), round(y, 6)), []).append(bore)
        depth = "through" if bore.through else millimetres(bore.depth)
        rows.append(
            (
                bore.label,
                SHORT[bore.purpose],
                f"{x:z.3f}",
                f"{y:z.3f}",
                bore.size,
                depth,
                position_words(bore, fixture.tolerances),
            )
        )
    for place, bores in there.items():
        words, widest_bore = ", ".join(b.label for b in bores), max(b.diameter for b in bores)
        if bores[0].purpose is Purpose.FLANGE:  # beside it, between the neck and the rim
            items.append(Words(words, end.at((0.7 * place[0], place[1])) - [0.0, 0.5 * TEXT], TEXT, "center"))
        else:
            items.append(end.label(place, MM * widest_bore, words, under=place[1] < 0.0))
    left = end.origin[0] + 0.5 * widest / scale + 22.0
    items += table(rows, np.array([left, top - BORDER - 6.0]), (12, 26, 18, 18, 34, 20, 32))
    items += [
        Words(
            "END (from z = top), x right, y up",
            end.origin + np.array([0.0, 0.5 * widest / scale + 6.0]),
            TEXT,
            "center",
        )
    ]
    notes = ["All stand-offs of one length within 0.02."]
    if part.name == "probe":
        pinned = any(bore.purpose is Purpose.PIN for bore in part.bores)
        notes = [*(PIN_NOTES if pinned else BALL_NOTES), FLANGE_NOTE]
    items += lines(notes, np.array([left, top - BORDER - 14.0 - LINE * len(rows)]))
    items += title(
        paper,
        (
            f"{fixture.name}: {part.name}",
            f"quantity {part.quantity}; {STEEL}; scale 1:{scale:g}, mm",
            f"general tolerances {GENERAL}; ends Ra 1.6, parallel 0.02",
            f"file {part.name}.step / .stl / .dxf",
        ),
    )
    return Page(name=part.name, paper=paper, scale=scale, items=tuple(items))


PIN_NOTES = [
    "P1: pin Ø6 g6 pressed in, 7 mm proud, 1 mm × 15° lead. P2: pin Ø3 g6, 5 mm proud, lead.",
    "P2 lies on the tool's x axis. Distance P1–P2 ±0.005. The face between the pins rests on the block.",
]
BALL_NOTES = [
    "P1: 90° cone for the ball, its axis within 0.02 of the flange's. P2: pocket for a magnet Ø5 × 4.",
    "The ball's centre, the tool's origin, lies a quarter of its diameter above the face.",
]
FLANGE_NOTE = "F1–F4: flange ISO 9409-1-50-4-M6, x axis between F1 and F4."
