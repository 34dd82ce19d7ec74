"""The drawing set: a page each for the plate, every shape of block, the probe, and what ties the plate down.

Each page says everything that a machinist needs: views, dimensions from datums, a table of holes, position
and angle tolerances from the plate's own budget, surfaces and material. The lists hold the same numbers. A
plate is seen from above, its datums are its top (A) and its lower and left edges (B, C); a turned part from
the side and its end.
"""

from dataclasses import replace

import numpy as np

from workbench.plate.parts.block_page import block_page
from workbench.plate.parts.drawing import (
    PAPERS,
    TEXT,
    Circle,
    Item,
    Layer,
    Line,
    Page,
    View,
    Words,
    paper_for,
)
from workbench.plate.parts.page_frame import (
    BORDER,
    BOTTOM,
    LENGTH,
    LINE,
    MM,
    SHORT,
    STEEL,
    TITLE,
    lines,
    millimetres,
    position_words,
    sheet,
    spread,
    table,
    thread_notes,
    title,
)
from workbench.plate.parts.parts import Bore, Fixture, Purpose, Slab, Turned
from workbench.plate.tolerances import GENERAL


def slab_page(fixture: Fixture, slab: Slab) -> Page:
    """Seen from above, origin at the lower left corner."""
    length, width, thickness = (MM * slab.size).tolist()
    own = slab is fixture.slab
    paper, scale = paper_for(length, width, (175.0, 80.0))
    _, top = PAPERS[paper]
    view = View(np.array([BORDER + 50.0, top - BORDER - 40.0 - width / scale]), scale)
    items: list[Item] = [view.line([(0, 0), (length, 0), (length, width), (0, width)])]
    places = [MM * (bore.mouth[:2] + 0.5 * slab.size[:2]) for bore in slab.bores]
    for place, bore in zip(places, slab.bores, strict=True):
        items += view.hole(place, MM * bore.diameter)
        if not bore.label[0].isdecimal():
            above = [other for other in places if 0.0 < other[1] - place[1] < 4.0 * TEXT * scale]
            under = any(abs(other[0] - place[0]) < 4.0 * TEXT * scale for other in above)
            items.append(view.label(place, MM * bore.diameter, bore.label, under=under))
    if own:
        items += _feet(fixture, view)
        items.append(Words("B", view.at((length, 0.0)) - np.array([8.0, 4.5]), 1.2 * TEXT))
        items.append(Words("C", view.at((0.0, 0.0)) - np.array([5.0, -3.0]), 1.2 * TEXT))
    across = view.across((0, 0), (length, 0), (0.0, -10.0), 0.0)
    up = view.across((length, 0), (length, width), (length / scale + 16.0, 0.0), 90.0)
    measured = [fixture.from_corner(block.pose[:3, 3]) for block in fixture.blocks] if own else places
    items += [across, up, *_ordinates(np.array(measured), view, width)]
    left = view.origin[0] + length / scale + 34.0
    rows = [("hole", "x", "y", "size", "for")] + [
        (bore.label, f"{x:z.3f}", f"{y:z.3f}", bore.size.split(" (core")[0], SHORT[bore.purpose])
        for (x, y), bore in zip(places, slab.bores, strict=True)
    ]
    room = int((top - BORDER - TITLE[1] - 50.0) / LINE)
    if len(rows) > room:
        rows = [*rows[: room - 1], ("…", "", "", "", f"{len(rows) - room} more in holes.csv")]
    items += table(rows, np.array([left, top - BORDER - 4.0]), (14, 24, 24, 26, 36))
    name = "plate" if own else "bottom plate"
    notes = (
        _plate_notes(fixture)
        if own
        else [
            "Robot's base frame: origin at the centre of R1–R4, x to the right, y up.",
            "All holes: position Ø0.2 to the lower and the left edge.",
        ]
    )
    items += lines(notes, np.array([left, top - BORDER - 10.0 - LINE * len(rows)]))
    items += title(
        paper,
        (
            f"{fixture.name}: {name}",
            f"{length:.1f} × {width:.1f} × {thickness:.1f}, quantity {slab.quantity}; all holes through",
            f"{fixture.stock.sheet if own else BOTTOM}; scale 1:{scale:g}, mm; seen from above",
            f"general tolerances {GENERAL}; surfaces Ra 3.2, top Ra 1.6; edges broken 0.3",
            f"file {slab.name}.step / .stl / .dxf",
        ),
    )
    return Page(name=slab.name, paper=paper, scale=scale, items=tuple(items))


def _feet(fixture: Fixture, view: View) -> list[Item]:
    """Outlines of the blocks with number and shape, a tick where faces slope down, and the robot's base."""
    items: list[Item] = []
    for block in fixture.blocks:
        foot = MM * (block.footprint + 0.5 * fixture.slab.size[:2])
        items.append(view.line(foot, Layer.BLOCKS))
        edge, middle = foot[1:3].mean(axis=0), foot.mean(axis=0)
        out = (edge - middle) / np.linalg.norm(edge - middle)
        items.append(Line(np.array([view.at(edge), view.at(edge) + 4.0 * out]), Layer.OUTLINE))
        label = f"{block.number} ({fixture.letter(block.number)})"
        corner = view.at(foot[np.argmax(foot.sum(axis=1))]) + np.array([1.0, 0.0])
        edge = view.at(MM * fixture.slab.size[:2]) - [1.2 * TEXT * len(label), 2.0 * TEXT]
        inside = bool((corner < edge).all())  # else at the opposite corner
        away = view.at(foot[np.argmin(foot.sum(axis=1))]) - [1.0, 1.4 * TEXT]
        items.append(Words(label, corner if inside else away, 1.2 * TEXT, "left" if inside else "right"))
    pose = np.linalg.inv(fixture.pose)
    centre = view.at(fixture.from_corner(pose[:3, 3]))
    if (centre > BORDER).all():
        items.append(Circle(centre, 1.2, Layer.CENTRES))
        for axis, name in ((0, "X robot"), (1, "Y robot")):
            tip = centre + 10.0 * pose[:2, axis]
            align = "left" if axis == 0 else "right"
            items += [Line(np.array([centre, tip]), Layer.CENTRES), Words(name, tip + 0.8, TEXT, align)]
    return items


def _ordinates(places: np.ndarray, view: View, width: float) -> list[Item]:
    """Places along x above the plate, along y left of it, spread where they would touch."""
    items: list[Item] = []
    for x, label in spread(places[:, 0] / view.scale, 4.2):
        start = view.origin + np.array([x, width / view.scale])
        foot = view.origin + np.array([label, width / view.scale + 10.0])
        items.append(Line(np.array([start + np.array([0, 1]), foot - [0, 3], foot]), Layer.DIMENSIONS))
        items.append(Words(f"{x * view.scale:z.3f}", foot + np.array([1.2, 1.0]), TEXT, "left", 90.0))
    for y, label in spread(places[:, 1] / view.scale, 4.2):
        start, foot = view.origin + np.array([0.0, y]), view.origin + np.array([-10.0, label])
        items.append(Line(np.array([start - [1, 0], foot + np.array([3, 0]), foot]), Layer.DIMENSIONS))
        items.append(Words(f"{y * view.scale:z.3f}", foot + np.array([-1.0, -1.2]), TEXT, "right"))
    return items


def _position_notes(fixture: Fixture) -> list[str]:
    across = f"position Ø{2 * MM * fixture.tolerances.place:.3f} to A B C"
    if fixture.stock.tapped:
        return ["Screw holes: the board's own. Drill the mounting holes, Ø0.2."]
    if not fixture.stock.doweled:
        return [f"Screw holes: {across}; mounting holes Ø0.2."]
    return [
        f"Dowel holes: {across}; screw and mounting holes Ø0.2;",
        f"the two dowel holes of a block Ø{MM * fixture.tolerances.pair:.3f} to each other.",
    ]


def _plate_notes(fixture: Fixture) -> list[str]:
    tolerances, pose = fixture.tolerances, np.linalg.inv(fixture.pose)
    x, y = fixture.from_corner(pose[:3, 3])
    low, held = ("+x", "anchor") if fixture.anchored else ("low", "target")
    return [
        "Datums: A top face, B lower edge, C left edge. Ordinates, for reference: screw holes.",
        *_position_notes(fixture),
        f"Ticks: {low} side of each block. Numbers: {held} (shape of its block).",
        f"Budget: {tolerances.note}.",
        f"Robot base at x {x:.2f}, y {y:.2f}, {MM * pose[2, 3]:+.2f} from A.",
    ]


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
            words = "(<>)" if i == len(part.steps) - 1 else "<>"  # the whole length gives the last one
            beside = (0.5 * widest / scale + 8.0, 0.0)
            items.append(side.across((radius, z), (radius, z + high), beside, 90.0, words))
        z += high
    probe = part.name == "probe"
    whole = f"<> ±{LENGTH:g}" if probe else "<>"
    items.append(side.across((0.0, 0.0), (0.0, z), (-0.5 * widest / scale - 10.0, 0.0), 90.0, whole))
    items.append(side.line([(0.0, -4.0), (0.0, z + 4.0)], Layer.CENTRES, closed=False))
    there: dict[tuple[float, float], list[Bore]] = {}
    rows = [("hole", "for", "x", "y", "size", "depth", "position")]
    for bore in part.bores:
        x, y = MM * bore.mouth[:2]
        across = 0.5 * MM * bore.diameter
        start, bottom = MM * bore.mouth[2], MM * bore.bottom[2]
        foot = 0.0 if bore.conical else across
        corners = [(x - across, start), (x + across, start), (x + foot, bottom), (x - foot, bottom)]
        items.append(side.line(corners, Layer.HIDDEN))
        items += end.hole((x, y), 2.0 * across)
        there.setdefault((round(x, 6), round(y, 6)), []).append(bore)
        depth = "through" if bore.through else millimetres(bore.depth)
        held = AXIAL if bore.conical else position_words(bore, fixture.tolerances)
        rows.append((bore.label, SHORT[bore.purpose], f"{x:z.3f}", f"{y:z.3f}", bore.size, depth, held))
    for place, bores in there.items():
        words, widest_bore = ", ".join(b.label for b in bores), max(b.diameter for b in bores)
        if bores[0].purpose is Purpose.FLANGE:  # outside the rim
            at = end.at(RIM * np.array(place)) - [0.0, 0.5 * TEXT]
            items.append(Words(words, at, TEXT, "center"))
            continue
        neck = 0.5 * MM * part.steps[-1][0]
        beyond = 0.8 * MM * widest_bore + 1.4 * TEXT * scale > neck  # no room within the neck: over it
        items.append(end.label(place, neck / 0.8 if beyond else MM * widest_bore, words))
    left = end.origin[0] + 0.5 * widest / scale + 22.0
    items += table(rows, np.array([left, top - BORDER - 6.0]), (12, 26, 18, 18, 34, 20, 32))
    items.append(end.title("END (from z = top), x right, y up", (0.0, 0.5 * widest), 6.0))
    notes = ["All stand-offs of one length within 0.02.", *thread_notes(part.bores)]
    if probe:
        pinned = any(bore.purpose is Purpose.PIN for bore in part.bores)
        notes = [*(PIN_NOTES if pinned else BALL_NOTES), *FLANGE_NOTES]
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


AXIAL = "Ø0.02 to the axis"
"""Position of the cone for the probe's ball."""
RIM = 1.42
"""Where the labels of the flange's holes stand, in distances of the holes from the axis."""
PIN_NOTES = [
    "P1: pin Ø6 g6 pressed in, 7 mm proud, 1 mm × 15° lead. P2: pin Ø3 g6, 5 mm proud, lead.",
    "P2 lies on the tool's x axis. Distance P1–P2 ±0.005. The face between the pins rests on the block.",
]
BALL_NOTES = [
    "P1: 90° cone for the ball. P2: pocket for a magnet Ø5 × 4.",
    "The ball's centre, the tool's origin, lies a quarter of its diameter above the face.",
]
FLANGE_NOTES = [
    "F1–F4: flange ISO 9409-1-50-4-M6, x axis between F1 and F4.",
    "There is no register: clock P1 true to the flange's axis when mounting.",
]


def pages_of(fixture: Fixture) -> tuple[Page, ...]:
    """All pages in order, the plate first."""
    drawn = [slab_page(fixture, fixture.slab)]
    drawn += [block_page(fixture, shape) for shape in fixture.shapes]
    drawn += [
        slab_page(fixture, part) if isinstance(part, Slab) else turned_page(fixture, part)
        for part in fixture.others
    ]
    return tuple(
        replace(page, items=(*page.items, *sheet(page, number, len(drawn))))
        for number, page in enumerate(drawn, start=1)
    )
