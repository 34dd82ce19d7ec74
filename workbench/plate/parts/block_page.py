"""The page of a block: front, foot from below, and the face square on.

Its datums are its foot (A), the middle between its dowels, or its tapped hole where it has none (B), and the
line of the dowels (C). On the face u runs downhill and v across, from the point above B.
"""

import numpy as np

from workbench.plate.parts.drawing import PAPERS, TEXT, Angle, Item, Layer, Page, View, Words, paper_for
from workbench.plate.parts.page_frame import (
    BORDER,
    FLAT,
    LINE,
    MM,
    SHORT,
    UPRIGHT,
    dowel_length,
    lines,
    millimetres,
    position_words,
    table,
    thread_notes,
    title,
)
from workbench.plate.parts.parts import Block, BlockShape, Fixture, Purpose
from workbench.plate.plate import Kind
from workbench.plate.tolerances import GENERAL, Tolerances

ROOM = 20.0
"""On paper a dimension for reference that is shorter has no room for its words; the notes say it [mm]."""


def block_page(fixture: Fixture, shape: BlockShape) -> Page:
    """The page of one shape of block."""
    block, tolerances = shape.block, fixture.tolerances
    high, side = MM * block.heights[1], MM * block.side
    slope = side / float(np.cos(block.tilt))
    paper, scale = paper_for(3.2 * side, high + side, (200.0, 70.0))
    _, top = PAPERS[paper]
    gap = 44.0
    front = View(np.array([BORDER + 45.0 + 0.5 * side / scale, top - BORDER - 22.0 - high / scale]), scale)
    foot = View(front.origin - [0.0, gap + 0.5 * side / scale], scale)
    face = View(front.origin + np.array([0.5 * (side + slope) / scale + 52.0, 0.5 * high / scale]), scale)
    left = face.origin[0] + 0.5 * slope / scale + 20.0
    items = [
        *_front(block, front, tolerances),
        *_foot(block, foot, tolerances),
        *_face(block, face, tolerances),
    ]
    items += table(
        _bore_rows(block, tolerances), np.array([left, top - BORDER - 6.0]), (15, 30, 17, 17, 32, 15, 32)
    )
    notes_at = np.array([left, top - BORDER - 14.0 - LINE * (len(block.bores) + 1)])
    items += lines(_block_notes(fixture, shape), notes_at)
    held = "anchor" if fixture.anchored else "target"
    numbers = f"{held}{'s' * (len(shape.numbers) > 1)} {', '.join(map(str, shape.numbers))}"
    low = "+x" if block.tilt <= FLAT else "low"
    items += title(
        paper,
        (
            f"{fixture.name}: block {shape.letter}",
            f"quantity {len(shape.numbers)}, for {numbers}; stamp letter and {held} on the {low} side",
            f"{fixture.stock.bar.format(side=side)}; scale 1:{scale:g}, mm",
            f"general tolerances {GENERAL}; {fixture.stock.surfaces}",
            f"file block-{shape.letter}.step / .stl / .dxf",
        ),
    )
    return Page(name=f"block-{shape.letter}", paper=paper, scale=scale, items=tuple(items))


def _right(block: Block) -> str:
    """What lies to the right in every view."""
    return "+x right" if block.tilt <= FLAT else "low side right"


def _front(block: Block, view: View, tolerances: Tolerances) -> list[Item]:
    """Seen along y: the mitre, the heights, the bores dashed."""
    half, (low, high) = 0.5 * MM * block.side, (MM * h for h in block.heights)
    items: list[Item] = [view.line([(-half, 0.0), (half, 0.0), (half, low), (-half, high)])]
    for bore in block.bores:
        items.append(view.line(MM * bore.outline, Layer.HIDDEN))
    items.append(view.line([(0.0, -4.0), (0.0, MM * block.height + 6.0)], Layer.CENTRES, closed=False))
    reach = half / view.scale
    if block.tilt > FLAT and low > ROOM * view.scale:
        items.append(view.across((half, 0.0), (half, low), (reach + 10.0, 0.0), 90.0, "(<>)"))
    items.append(view.across((-half, 0.0), (-half, high), (-reach - 22.0, 0.0), 90.0, "(<>)"))
    middle = f"<> ±{MM * tolerances.height:.3g}"
    items.append(view.across((0.0, 0.0), (0.0, MM * block.height), (-reach - 10.0, 0.0), 90.0, middle))
    if block.tilt > FLAT:
        tilt = np.rad2deg(block.tilt)
        items.append(view.line([(half, low), (-half, low)], Layer.CENTRES, closed=False))
        words = f"{tilt:.4f}° ±{np.rad2deg(tolerances.mitre):.3g}°"
        at = view.at((half, high)) - [0.0, 4.0]
        items.append(Angle(view.at((half, low)), 1.5 * reach, 180.0 - tilt, 180.0, words, at))
    items.append(Words("A", view.at((0.7 * half, 0.0)) - [0.0, 4.0], 1.2 * TEXT, "center"))
    return [*items, view.title(f"FRONT (along +y), {_right(block)}", (0.0, high), 12.0)]


def _foot(block: Block, view: View, tolerances: Tolerances) -> list[Item]:
    """Seen from below: x to the right, y downwards."""
    half = 0.5 * MM * block.side
    items: list[Item] = [view.line([(-half, -half), (half, -half), (half, half), (-half, half)])]
    offsets = []
    for number, bore in enumerate(block.bores, start=1):
        if bore.direction[2] > 0.0:
            x, y = MM * bore.mouth[:2]
            items += view.hole((x, -y), MM * bore.diameter, f"{number}")
            offsets.append(-float(y))
    reach = half / view.scale
    a, b = min(offsets), max(offsets)
    if b - a > 1.0:
        items.append(view.across((0.0, 0.0), (0.0, b), (-reach - 10.0, 0.0), 90.0, "(<>)"))
        items.append(view.across((0.0, a), (0.0, 0.0), (-reach - 10.0, 0.0), 90.0, "(<>)"))
        items.append(Words("C", view.at((0.0, b)) + np.array([3.0, 3.0]), 1.2 * TEXT))
    items.append(view.across((-half, -half), (half, -half), (0.0, -reach - 10.0), 0.0))
    items.append(view.across((half, -half), (half, half), (reach + 10.0, 0.0), 90.0))
    items.append(Words("B", view.at((0.0, 0.0)) + np.array([4.0, 3.0]), 1.2 * TEXT))
    return [*items, view.title(f"FOOT (from below), {_right(block)}", (0.0, half), 4.0)]


def _face(block: Block, view: View, tolerances: Tolerances) -> list[Item]:
    """Seen square on the face: u downhill to the right, v up."""
    half = 0.5 * MM * block.side
    slope = half / float(np.cos(block.tilt))
    items: list[Item] = [view.line([(-slope, -half), (slope, -half), (slope, half), (-slope, half)])]
    items.append(view.line([(-slope - 4.0, 0.0), (slope + 8.0, 0.0)], Layer.CENTRES, closed=False))
    for number, bore in enumerate(block.bores, start=1):
        if bore.direction[2] > 0.0:
            continue
        label = "1, 2" if block.bores[1].purpose is Purpose.MAGNET else f"{number}"
        items += view.hole(
            block.on_face(bore), MM * bore.diameter, label * (bore.purpose is not Purpose.MAGNET)
        )
        if bore.purpose is Purpose.INDEX:
            top = view.at((0.0, half)) + np.array([-14.0, 5.0])
            items += _index(view, block.on_face(bore), tolerances, top)
    items.append(view.across((-slope, -half), (slope, -half), (0.0, -half / view.scale - 10.0), 0.0, "(<>)"))
    items.append(Words("u", view.at((slope + 9.0, -1.0)), 1.2 * TEXT))
    return [*items, view.title(f"FACE (square on), {_right(block)}", (0.0, half), 16.0)]


def _index(view: View, place: tuple[float, float], tolerances: Tolerances, top: np.ndarray) -> list[Item]:
    """The index hole's distance and direction from downhill, its words at a point."""
    u, v = place
    angle = float(np.rad2deg(np.arctan2(v, u)))
    radius = float(np.hypot(u, v))
    ray = [(0.0, 0.0), (1.5 * u, 1.5 * v)]
    side = np.array([-v, u]) / radius
    words = f"{angle:.4f}° ±{np.rad2deg(tolerances.turn):.3g}°"
    start, end = (0.0, angle) if angle >= 0.0 else (angle, 0.0)
    items: list[Item] = [view.line(ray, Layer.CENTRES, closed=False)]
    if abs(angle) > 0.01:
        items.append(Angle(view.origin, 1.35 * radius / view.scale, start, end, words, top))
    else:
        items.append(Words(words, top))
    away = side * (9.0 if angle >= 0.0 else -9.0)
    items.append(view.across((0.0, 0.0), place, away, angle))
    return items


def _bore_rows(block: Block, tolerances: Tolerances) -> list[tuple[str, ...]]:
    """One line a bore: where it starts, how large and deep, and how well it is placed."""
    rows: list[tuple[str, ...]] = [("hole", "for", "u / x", "v / y", "size", "depth", "position")]
    for number, bore in enumerate(block.bores, start=1):
        on_face = bore.direction[2] < 0.0
        place = block.on_face(bore) if on_face else tuple(MM * bore.mouth[:2])
        rows.append(
            (
                f"{number} {'face' if on_face else 'foot'}",
                SHORT[bore.purpose],
                *(f"({v:z.3f})" if bore.purpose is Purpose.INDEX else f"{v:z.3f}" for v in place),
                bore.size.split(" (core")[0],
                millimetres(bore.depth),
                position_words(bore, tolerances),
            )
        )
    return rows


def _block_notes(fixture: Fixture, shape: BlockShape) -> list[str]:
    block, tolerances, stock = shape.block, fixture.tolerances, fixture.stock
    flat = block.tilt <= FLAT
    seat = block.kind is Kind.SEAT
    middle, turned = "axis of the foot's screw", f"the {'+x' if flat else 'low'} edge"
    if stock.doweled:
        middle, turned = "midway between the dowel holes", "their line"
    pins = [f"Dowel holes fit pins Ø4 m6 × {dowel_length(fixture):g}."] if stock.doweled else []
    mitre, height = f"{np.rad2deg(tolerances.mitre):.3g}°", f"height {MM * block.height:.3f} above A at B"
    sloping = [
        f"Face: mitre {np.rad2deg(block.tilt):.4f}° to A, {height};",
        f"its level lines parallel to C within ±{mitre}; edges at",
        f"{MM * block.heights[0]:.3f} (low) and {MM * block.heights[1]:.3f} (high) for reference.",
    ]
    index = [f"Index hole from downhill: see FACE, ±{np.rad2deg(tolerances.turn):.3g}° to C."] if seat else []
    ball = [f"Cone for a ball of Ø{MM * stock.ball:.3g}, its centre over B."]
    return [
        f"Datums: A foot, B {middle}, C {turned} (square to u).",
        "B lies in the foot's middle, u = v = 0 of the face over B;",
        f"u runs {'along +x (mark this side)' if flat else 'downhill'}, v along +y (down in FOOT).",
        f"Face holes are square to the face{f' within {UPRIGHT:g}' if seat else ''}.",
        *([f"Face: parallel to A within ±{mitre}, {height}."] if flat else sloping),
        *index,
        *thread_notes(block.bores),
        f"Budget: {tolerances.note}.",
        *pins,
        *(
            ["Seat and index hole fit the probe's pins g6."]
            if seat
            else ball
            if block.kind is Kind.SOCKET
            else []
        ),
    ]
