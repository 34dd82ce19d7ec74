"""The lists beside the drawings: holes, blocks, their bores, targets, and parts.

Positions on the plate count from the lower left corner of its top face, along its x and y axes. Bores of a
block's face count from the point above its screw, u downhill and v across (`drawing_set`); those of its foot
from the screw, along the block's x (downhill) and y. Targets are poses of the tool in the robot's base,
R = Rz(yaw) Ry(pitch) Rx(roll), in the columns that an as-measured plate is read from.
"""

import csv
import io
from collections.abc import Iterable, Sequence

import numpy as np

from workbench.base import se3
from workbench.extras.workshop.parts import Bore, Fixture, Purpose, Slab
from workbench.plate.plate import Kind, Plate
from workbench.plate.tolerances import Tolerances

TARGET_COLUMNS = ("target", "x[mm]", "y[mm]", "z[mm]", "roll[deg]", "pitch[deg]", "yaw[deg]")
MM = 1e3
BOTTOM = "EN AW-5083"
STEEL = "C45"
RADIAL = 0.01
"""± of an index hole's distance from the seat [mm]."""
SHORT_OF = 2.0
"""Threads and screws end so far above the bottom of their hole [mm]."""
SCREWS = (8.0, 10.0, 12.0, 16.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
"""Lengths in which ISO 4762 and ISO 4026 sell M6 and M8 [mm]."""
DOWELS = (10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 24.0, 28.0, 32.0, 36.0, 40.0)
"""Lengths in which ISO 8734 sells Ø4 [mm]."""
PIN_PLACE = 0.01
"""Diameter in which the probe's pins lie [mm]."""


def holes_csv(fixture: Fixture) -> str:
    """Every hole of the plate: label, what it is, place from the lower left corner, diameter, depth."""
    head = ("hole", "purpose", "x[mm]", "y[mm]", "diameter[mm]", "depth[mm]", "through")
    rows = []
    for bore in fixture.slab.bores:
        place = (f"{v:.4f}" for v in fixture.from_corner(bore.mouth))
        sizes = (f"{MM * bore.diameter:.3f}", f"{MM * bore.depth:.3f}", "yes" if bore.through else "no")
        rows.append((bore.label, bore.purpose, *place, *sizes))
    return csv_text(head, rows)


def blocks_csv(fixture: Fixture) -> str:
    """Every block: its shape's letter, its place and turn on the plate, its height and mitre angle."""
    head = (
        *("target", "shape", "kind", "x[mm]", "y[mm]", "turn[deg]"),
        *("tilt[deg]", "height[mm]", "lowest_edge[mm]", "highest_edge[mm]", "side[mm]"),
    )
    rows = []
    for block in fixture.blocks:
        place = (*fixture.from_corner(block.pose[:3, 3]), np.rad2deg(block.azimuth), np.rad2deg(block.tilt))
        sizes = (MM * h for h in (block.height, *block.heights, block.side))
        numbers = (f"{v:z.4f}" for v in (*place, *sizes))
        rows.append((str(block.number), fixture.letter(block.number), str(block.kind), *numbers))
    return csv_text(head, rows)


def targets_csv(plate: Plate) -> str:
    """Poses of the tool at the targets in the robot's base, to full precision."""
    angles = np.rad2deg(se3.matrix_to_rpy(plate.poses[:, :3, :3]))
    places = MM * plate.poses[:, :3, 3]
    rows = np.column_stack([places, angles]).tolist()
    return csv_text(TARGET_COLUMNS, ((str(i), *map(repr, row)) for i, row in enumerate(rows, start=1)))


def distances_csv(plate: Plate) -> str:
    """Of a ball-bar's plate: how long the bar is between every target and anchor."""
    assert plate.anchors is not None
    distances = np.linalg.norm(plate.poses[:, None, :3, 3] - se3.apply(plate.pose, plate.anchors), axis=2)
    rows = [(str(i + 1), str(k + 1), f"{MM * distances[i, k]:.4f}") for i, k in np.ndindex(*distances.shape)]
    return csv_text(("target", "anchor", "distance[mm]"), rows)


def csv_text(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return buffer.getvalue()


def bores_csv(fixture: Fixture) -> str:
    """Every bore of every shape of block: on face or foot, its place there, size, depth and tolerance."""
    places = ("u[mm]", "v[mm]", "from_downhill[deg]")
    head = ("shape", "on", "purpose", *places, "diameter[mm]", "size", "depth[mm]", "position_tolerance")
    rows = []
    for shape in fixture.shapes:
        for bore in shape.block.bores:
            on_face = bore.direction[2] < 0.0
            u, v = shape.block.on_face(bore) if on_face else MM * bore.mouth[:2]
            angle = np.rad2deg(np.arctan2(v, u)) if np.hypot(u, v) > 1e-6 else 0.0
            numbers = (f"{value:z.4f}" for value in (u, v, angle, MM * bore.diameter))
            cells = (bore.size, f"{MM * bore.depth:.4f}", position_text(bore, fixture.tolerances))
            rows.append((shape.letter, "face" if on_face else "foot", str(bore.purpose), *numbers, *cells))
    return csv_text(head, rows)


def parts_csv(fixture: Fixture) -> str:
    """The parts list: what is made, from what, and what is bought."""
    made: list[tuple[str, int, str, str, str]] = [
        ("plate", 1, fixture.stock.sheet, _edges(fixture.slab), "plate")
    ]
    for shape in fixture.shapes:
        side = MM * shape.block.side
        size = f"bar {side:.0f} × {side:.0f} × {MM * shape.block.heights[1]:.1f}"
        bar, files = fixture.stock.bar.format(side=side), f"block-{shape.letter}"
        made.append((f"block {shape.letter}", len(shape.numbers), bar, size, files))
    for part in fixture.others:
        if isinstance(part, Slab):
            material, size = BOTTOM, _edges(part)
        else:
            material = STEEL
            size = f"Ø{MM * max(d for d, _ in part.steps):.0f} × {MM * part.length:.1f}"
        made.append((part.name, part.quantity, material, size, part.name))
    count = len(fixture.blocks)
    stock, kinds = fixture.stock, {block.kind for block in fixture.blocks}
    thickness = fixture.slab.size[2]
    bought = [(stock.fastener, count, "8.8", _screw(thickness, stock.thread), "")]
    if stock.doweled:
        pin = f"{dowel_length(fixture):g} long"
        bought.append(("dowel pin ISO 8734 Ø4 m6", 2 * count, "hardened", pin, ""))
    if fixture.probe is not None:
        bought.append(("screw ISO 4762 M6, for the probe's flange", 4, "8.8", "16 long", ""))
    if Kind.SEAT in kinds:
        bought += [("pin Ø6 g6", 1, "hardened", "19 long", ""), ("pin Ø3 g6", 1, "hardened", "15 long", "")]
    if Kind.SOCKET in kinds:
        balls = 1 + (count if fixture.anchored else 0)
        bought.append((f"ball Ø{MM * stock.ball:.3g} G10", balls, "bearing steel", "", ""))
    if stock.magnet is not None:
        bought.append(("magnet Ø5 × 4", 1 + count, "NdFeB", "", ""))
    if fixture.anchored:
        bought.append(("ball-bar, telescoping, read to 5 µm", 1, "", "lengths in distances.csv", ""))
    if fixture.standoff is not None and fixture.bottom is not None:
        post = fixture.standoff
        through = min(thickness, fixture.bottom.size[2])
        size = _screw(through, min(bore.depth for bore in post.bores))
        bought.append(("screw ISO 4762 M8", 2 * post.quantity, "8.8", size, ""))
    head = ("item", "part", "quantity", "material", "size", "files")
    return csv_text(head, ((str(i), *map(str, row)) for i, row in enumerate([*made, *bought], start=1)))


def _screw(thickness: float, depth: float) -> str:
    """The longest screw sold that goes through a plate and ends above the bottom of its hole [m]."""
    return f"{longest(SCREWS, MM * (thickness + depth) - SHORT_OF):g} long"


def _edges(slab: Slab) -> str:
    return " × ".join(f"{edge:.1f}" for edge in MM * slab.size)


def position_text(bore: Bore, tolerances: Tolerances) -> str:
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


def longest(sold: Sequence[float], room: float) -> float:
    """The longest one sold that has room, or the shortest [mm]."""
    return max((length for length in sold if length <= room + 1e-6), default=min(sold))


def dowel_length(fixture: Fixture) -> float:
    """Length of the pins through the plate into a block [mm]."""
    return longest(DOWELS, MM * (fixture.slab.size[2] + fixture.stock.dowel_depth))
