"""The drawings: a sheet each for the plate, every shape of block, the probe, and what ties the plate down.

Each says everything that a machinist needs: views, dimensions from datums, a table of holes, tolerances from
the plate's own budget, surfaces and material; the lists hold the same numbers. A plate is seen from above;
its datums are its top (A) and its lower and left edges (B, C). A block's datums are its foot (A), the middle
between its dowels, or its tapped hole where it has none (B), and the line of the dowels (C); on its face u
runs downhill and v across, from the point above B. A turned part is seen from the side and its end.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from workbench.extras.workshop.csv_lists import BOTTOM, MM, SHORT_OF, STEEL, dowel_length, position_text
from workbench.extras.workshop.drawing import TEXT, DrawingSheet, View
from workbench.extras.workshop.labels import label_blocks
from workbench.extras.workshop.parts import Block, BlockShape, Bore, Fixture, Purpose, Slab, Turned
from workbench.plate.plate import Kind
from workbench.plate.tolerances import GENERAL, Tolerances

UPRIGHT = 0.005
"""How far a seat or an index hole may lean over its depth [mm]."""
FLAT = 1e-6
"""A face that slopes less has no low side [rad]."""
LENGTH = 0.02
"""± of the probe's length, which is the tool's [mm]."""
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
MAX_TABLE_ROWS = 50
"""Of a plate's table of holes; holes.csv has them all."""
Rows = list[tuple[str, ...]]


@lru_cache(maxsize=1)
def drawings_of(fixture: Fixture) -> dict[str, DrawingSheet]:
    """The sheets by the name of their file, the plate first; drawn once for all formats."""
    drawn = {"plate": slab_sheet(fixture, fixture.slab)}
    drawn |= {f"block-{shape.letter}": block_sheet(fixture, shape) for shape in fixture.shapes}
    for part in fixture.others:
        drawn[part.name] = (
            slab_sheet(fixture, part) if isinstance(part, Slab) else turned_sheet(fixture, part)
        )
    return drawn


def slab_sheet(fixture: Fixture, slab: Slab) -> DrawingSheet:
    """Seen from above, origin at the lower left corner."""
    length, width, thickness = (MM * slab.size).tolist()
    own, sheet = slab is fixture.slab, DrawingSheet(max(length, width))
    view = sheet.view(0.0, 0.0)
    view.line([(0, 0), (length, 0), (length, width), (0, width)])
    places = [MM * (bore.mouth[:2] + 0.5 * slab.size[:2]) for bore in slab.bores]
    for place, bore in zip(places, slab.bores, strict=True):
        view.hole(place, MM * bore.diameter)
        if not bore.label[0].isdecimal():
            near = [other - place for other in places if 0.0 < other[1] - place[1] < 4 * TEXT * sheet.scale]
            under = any(abs(x) < 4 * TEXT * sheet.scale for x, _ in near)
            off = 0.8 * MM * bore.diameter / sheet.scale + 0.6
            view.text(bore.label, place, (0.0, -off - TEXT if under else off))
    if own:
        _feet(fixture, view)
        view.text("B", (length, 0.0), (-8.0, -4.5), large=True)
        view.text("C", (0.0, 0.5 * width), (-5.0, 0.0), large=True)
    view.across((0, 0), (length, 0), (0.0, -12.0), 0.0)
    view.across((length, 0), (length, width), (12.0, 0.0), 90.0, by=(length, 0.0))
    if own:
        labels = [f"{block.number} ({fixture.letter(block.number)})" for block in fixture.blocks]
        label_blocks(view, labels, [_foot_of(fixture, block) for block in fixture.blocks])
    rows: Rows = [("hole", "x", "y", "size", "for")]
    rows += [
        (bore.label, f"{x:z.3f}", f"{y:z.3f}", bore.size.split(" (core")[0], SHORT[bore.purpose])
        for (x, y), bore in zip(places, slab.bores, strict=True)
    ]
    if len(rows) > MAX_TABLE_ROWS:
        rows = [*rows[:MAX_TABLE_ROWS], ("…", "", "", "", f"{len(rows) - MAX_TABLE_ROWS} more in holes.csv")]
    base = [
        "Robot's base frame: origin at the centre of R1–R4, x to the right, y up.",
        "All holes: position Ø0.2 to the lower and the left edge.",
    ]
    title = (
        f"{fixture.name}: {'plate' if own else 'bottom plate'}",
        f"{length:.1f} × {width:.1f} × {thickness:.1f}, quantity {slab.quantity}; all holes through",
        f"{fixture.stock.sheet if own else BOTTOM}; scale 1:{sheet.scale:g}, mm; seen from above",
        f"general tolerances {GENERAL}; surfaces Ra 3.2, top Ra 1.6; edges broken 0.3",
    )
    x, y = view.at((length, width), (24.0, 0.0))
    sheet.column(x, y, title, rows, _plate_notes(fixture) if own else base)
    return sheet


def _feet(fixture: Fixture, view: View) -> None:
    """Outlines of the blocks, a tick where faces slope down, and the robot's base."""
    for block in fixture.blocks:
        foot = _foot_of(fixture, block)
        view.line(foot, "BLOCKS")
        edge, middle = foot[1:3].mean(axis=0), foot.mean(axis=0)
        view.line([edge, 0.7 * edge + 0.3 * middle], closed=False)
    pose = np.linalg.inv(fixture.pose)
    centre = fixture.from_corner(pose[:3, 3])
    view.circle(centre, 2.4 * view.sheet.scale, "CENTRES")
    for axis, name in enumerate(("X robot", "Y robot")):
        tip = centre + 10.0 * view.sheet.scale * pose[:2, axis]
        view.line([centre, tip], "CENTRES", closed=False)
        view.text(name, tip, (0.8, 0.8), align="left")


def _foot_of(fixture: Fixture, block: Block) -> np.ndarray:
    return MM * (block.footprint + 0.5 * fixture.slab.size[:2])


def _plate_notes(fixture: Fixture) -> list[str]:
    tolerances, pose = fixture.tolerances, np.linalg.inv(fixture.pose)
    x, y = fixture.from_corner(pose[:3, 3])
    low, held = ("+x", "anchor") if fixture.anchored else ("low", "target")
    across = f"position Ø{2 * MM * tolerances.place:.3f} to A B C"
    holes = [
        f"Dowel holes: {across}; screw and mounting holes Ø0.2;",
        f"the two dowel holes of a block Ø{MM * tolerances.pair:.3f} to each other.",
    ]
    if fixture.stock.tapped:
        holes = ["Screw holes: the board's own. Drill the mounting holes, Ø0.2."]
    elif not fixture.stock.doweled:
        holes = [f"Screw holes: {across}; mounting holes Ø0.2."]
    return [
        "Datums: A top face, B lower edge, C left edge.",
        *holes,
        f"Ticks: {low} side of each block. Numbers: {held} (shape of its block).",
        f"Budget: {tolerances.note}.",
        f"Robot base at x {x:.2f}, y {y:.2f}, {MM * pose[2, 3]:+.2f} from A.",
    ]


def block_sheet(fixture: Fixture, shape: BlockShape) -> DrawingSheet:
    """One shape of block: front, foot from below, and the face square on."""
    block, tolerances = shape.block, fixture.tolerances
    high, side = MM * block.heights[1], MM * block.side
    slope, sheet = side / float(np.cos(block.tilt)), DrawingSheet(max(3.2 * side, high + side))
    front = sheet.view(0.0, 0.0)
    foot = sheet.view(*front.at((0.0, -0.5 * side), (0.0, -30.0)))
    face = sheet.view(*front.at((0.5 * (side + slope), 0.5 * high), (50.0, 0.0)))
    _front(block, front, tolerances)
    _foot(block, foot)
    _face(block, face, tolerances)
    held = "anchor" if fixture.anchored else "target"
    numbers = f"{held}{'s' * (len(shape.numbers) > 1)} {', '.join(map(str, shape.numbers))}"
    title = (
        f"{fixture.name}: block {shape.letter}",
        f"quantity {len(shape.numbers)}, for {numbers}",
        f"stamp letter and {held} on the {'+x' if block.tilt <= FLAT else 'low'} side",
        f"{fixture.stock.bar.format(side=side)}; scale 1:{sheet.scale:g}, mm",
        f"general tolerances {GENERAL}; {fixture.stock.surfaces}",
    )
    x, _ = face.at((0.5 * slope, 0.0), (20.0, 0.0))
    _, y = front.at((0.0, high), (0.0, 20.0))
    sheet.column(x, y, title, _bore_rows(block, tolerances), _block_notes(fixture, shape))
    return sheet


def _right(block: Block) -> str:
    """What lies to the right in every view."""
    return "+x right" if block.tilt <= FLAT else "low side right"


def _front(block: Block, view: View, tolerances: Tolerances) -> None:
    """Seen along y: the mitre, the heights, the bores dashed."""
    half, (low, high) = 0.5 * MM * block.side, (MM * h for h in block.heights)
    left, right, middle = (-half, 0.0), (half, 0.0), MM * block.height
    view.line([left, right, (half, low), (-half, high)])
    for bore in block.bores:
        view.line(MM * bore.outline, "HIDDEN")
    view.line([(0.0, -4.0), (0.0, middle + 6.0)], "CENTRES", closed=False)
    view.across(left, (-half, high), (-22.0, 0.0), 90.0, "(<>)", by=left)
    view.across((0.0, 0.0), (0.0, middle), (-11.0, 0.0), 90.0, f"<> ±{MM * tolerances.height:.3g}", by=left)
    if block.tilt > FLAT:
        view.across(right, (half, low), (10.0, 0.0), 90.0, "(<>)", by=right)
        tilt = float(np.rad2deg(block.tilt))
        view.line([(half, low), (-half, low)], "CENTRES", closed=False)
        label = f"{tilt:.4f}° ±{np.rad2deg(tolerances.mitre):.3g}°"
        at = view.at((half, high), (2.0, -4.0))
        view.angle((half, low), 1.5 * half, 180.0 - tilt, 180.0, label, at)
    view.text("A", (0.7 * half, 0.0), (0.0, -4.0), large=True)
    view.text(f"FRONT (along +y), {_right(block)}", (0.0, high), (0.0, 12.0))


def _foot(block: Block, view: View) -> None:
    """Seen from below: x to the right, y downwards."""
    half = 0.5 * MM * block.side
    view.line([(-half, -half), (half, -half), (half, half), (-half, half)])
    offsets = []
    for number, bore in enumerate(block.bores, start=1):
        if bore.direction[2] > 0.0:
            place = MM * bore.mouth[:2] * [1.0, -1.0]
            view.hole(place, MM * bore.diameter)
            view.text(
                f"{number}", place + np.array([0.5 * MM * bore.diameter, 0.0]), (1.5, -4.0), align="left"
            )
            offsets.append(float(place[1]))
    a, b = min(offsets), max(offsets)
    if b - a > 1.0:
        for one, two in (((0.0, 0.0), (0.0, b)), ((0.0, a), (0.0, 0.0))):
            view.across(one, two, (-11.0, 0.0), 90.0, "(<>)", by=(-half, 0.0))
        view.text("C", (0.0, b), (3.0, 3.0), large=True)
    view.across((-half, -half), (half, -half), (0.0, -11.0), 0.0, by=(0.0, -half))
    view.across((half, -half), (half, half), (11.0, 0.0), 90.0, by=(half, 0.0))
    view.text("B", (0.0, 0.0), (4.0, 3.0), large=True)
    view.text(f"FOOT (from below), {_right(block)}", (0.0, half), (0.0, 4.0))


def _face(block: Block, view: View, tolerances: Tolerances) -> None:
    """Seen square on the face: u downhill to the right, v up."""
    half = 0.5 * MM * block.side
    slope = half / float(np.cos(block.tilt))
    view.line([(-slope, -half), (slope, -half), (slope, half), (-slope, half)])
    view.line([(-slope - 4.0, 0.0), (slope + 8.0, 0.0)], "CENTRES", closed=False)
    for number, bore in enumerate(block.bores, start=1):
        if bore.direction[2] > 0.0:
            continue
        place, radius = np.array(block.on_face(bore)), 0.5 * MM * bore.diameter
        view.hole(place, 2.0 * radius)
        if bore.purpose is not Purpose.MAGNET:
            label = "1, 2" if block.bores[1].purpose is Purpose.MAGNET else f"{number}"
            view.text(label, place + np.array([radius, 0.0]), (1.5, -4.0), align="left")
        if bore.purpose is Purpose.INDEX:
            _index(view, place, tolerances, view.at((0.0, half), (-14.0, 5.0)))
    view.across((-slope, -half), (slope, -half), (0.0, -11.0), 0.0, "(<>)", by=(0.0, -half))
    view.text("u", (slope + 9.0, -1.0), large=True)
    view.text(f"FACE (square on), {_right(block)}", (0.0, half), (0.0, 16.0))


def _index(view: View, place: np.ndarray, tolerances: Tolerances, top: np.ndarray) -> None:
    """The index hole's distance and direction from downhill, its text at a place of the sheet."""
    radius, angle = float(np.hypot(*place)), float(np.rad2deg(np.arctan2(place[1], place[0])))
    label = f"{angle:.4f}° ±{np.rad2deg(tolerances.turn):.3g}°"
    view.line([(0.0, 0.0), 1.5 * place], "CENTRES", closed=False)
    if abs(angle) > 0.01:
        view.angle((0.0, 0.0), 1.35 * radius, min(angle, 0.0), max(angle, 0.0), label, top)
    else:
        view.sheet.text(label, top)
    side = np.array([-place[1], place[0]]) / radius
    view.across((0.0, 0.0), place, side * (9.0 if angle >= 0.0 else -9.0), angle)


def _bore_rows(block: Block, tolerances: Tolerances) -> Rows:
    """One line a bore: where it starts, how large and deep, and how well it is placed."""
    rows: Rows = [("hole", "for", "u / x", "v / y", "size", "depth", "position")]
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
                position_text(bore, tolerances),
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


def turned_sheet(fixture: Fixture, part: Turned) -> DrawingSheet:
    """Side view and end view."""
    widest, sheet = MM * max(diameter for diameter, _ in part.steps), DrawingSheet(MM * part.length)
    side = sheet.view(0.0, 0.0)
    end = sheet.view(*side.at((widest, 0.5 * MM * part.length), (40.0, 0.0)))
    z = 0.0
    for number, (diameter, length) in enumerate(part.steps):
        radius, high = 0.5 * MM * diameter, MM * length
        side.line([(-radius, z), (radius, z), (radius, z + high), (-radius, z + high)])
        end.circle((0.0, 0.0), 2.0 * radius, "OUTLINE")
        side.across((-radius, z), (radius, z), (0.0, -10.0 - 8.0 * number), 0.0, "Ø<>")
        if len(part.steps) > 1:
            label = "(<>)" if number == len(part.steps) - 1 else "<>"  # the whole length gives the last one
            side.across((radius, z), (radius, z + high), (8.0, 0.0), 90.0, label, by=(0.5 * widest, 0.0))
        z += high
    probe = part.name == "probe"
    whole = f"<> ±{LENGTH:g}" if probe else "<>"
    side.across((0.0, 0.0), (0.0, z), (-10.0, 0.0), 90.0, whole, by=(-0.5 * widest, 0.0))
    side.line([(0.0, -4.0), (0.0, z + 4.0)], "CENTRES", closed=False)
    there: dict[tuple[float, float], list[Bore]] = {}
    rows: Rows = [("hole", "for", "x", "y", "size", "depth", "position")]
    for bore in part.bores:
        x, y = MM * bore.mouth[:2]
        across = 0.5 * MM * bore.diameter
        start, bottom = MM * bore.mouth[2], MM * bore.bottom[2]
        foot = 0.0 if bore.conical else across
        side.line(
            [(x - across, start), (x + across, start), (x + foot, bottom), (x - foot, bottom)], "HIDDEN"
        )
        end.hole(MM * bore.mouth[:2], 2.0 * across)
        there.setdefault((round(x, 6), round(y, 6)), []).append(bore)
        depth = "through" if bore.through else millimetres(bore.depth)
        held = AXIAL if bore.conical else position_text(bore, fixture.tolerances)
        rows.append((bore.label, SHORT[bore.purpose], f"{x:z.3f}", f"{y:z.3f}", bore.size, depth, held))
    for (x, y), bores in there.items():
        label, neck = ", ".join(bore.label for bore in bores), 0.5 * MM * part.steps[-1][0]
        if bores[0].purpose is Purpose.FLANGE:  # outside the rim
            end.text(label, (RIM * x, RIM * y), (0.0, -0.5 * TEXT))
            continue
        off = 0.4 * MM * max(bore.diameter for bore in bores)
        beyond = 2.0 * off + 1.4 * TEXT * sheet.scale > neck  # no room within the neck: over it
        end.text(label, (x, y + (neck if beyond else 2.0 * off)), (0.0, 0.6))
    notes = ["All stand-offs of one length within 0.02.", *thread_notes(part.bores)]
    if probe:
        pinned = any(bore.purpose is Purpose.PIN for bore in part.bores)
        notes = [*(PIN_NOTES if pinned else BALL_NOTES), *FLANGE_NOTES]
    title = (
        f"{fixture.name}: {part.name}",
        f"quantity {part.quantity}; {STEEL}; scale 1:{sheet.scale:g}, mm",
        f"general tolerances {GENERAL}; ends Ra 1.6, parallel 0.02",
    )
    end.text("END (from z = top), x right, y up", (0.0, 0.5 * widest), (0.0, 6.0))
    x, _ = end.at((0.5 * RIM * widest, 0.0), (20.0, 0.0))
    sheet.column(x, float(side.at((0.0, z), (0.0, 10.0))[1]), title, rows, notes)
    return sheet


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


def millimetres(value: float) -> str:
    """A length in metres as a number of millimetres."""
    return f"{MM * value:z.3f}"


def thread_notes(bores: Sequence[Bore]) -> list[str]:
    """How deep threads are cut, where there are any."""
    if not any(bore.size.startswith("M") and not bore.through for bore in bores):
        return []
    return [f"Depth of a thread: its core's; the thread ends {SHORT_OF:g} above the bottom."]
