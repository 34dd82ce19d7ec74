"""Lists for workshop and measuring room: holes, blocks, and the targets as they should come out.

Places on the plate count from the lower left corner of its top face, as in the drawing, along the plate's x
and y axes. Targets are poses of the tool in the robot's base, R = Rz(yaw) Ry(pitch) Rx(roll), in the columns
that an as-measured plate is read from.
"""

import csv
import io
from collections.abc import Iterable

import numpy as np

from workbench.base import se3
from workbench.base.types import Vector3
from workbench.plate.parts.parts import Fixture
from workbench.plate.plate import Plate

TARGET_COLUMNS = ("target", "x[mm]", "y[mm]", "z[mm]", "roll[deg]", "pitch[deg]", "yaw[deg]")
MM = 1e3


def from_corner(fixture: Fixture, place: Vector3) -> tuple[float, float]:
    """A place on the plate's top, counted from its lower left corner [mm]."""
    x, y = MM * (place[:2] + 0.5 * fixture.slab.size[:2])
    return float(x), float(y)


def holes_csv(fixture: Fixture) -> str:
    """Every hole of the plate: label, what it is, place from the lower left corner, diameter, depth."""
    head = ("hole", "purpose", "x[mm]", "y[mm]", "diameter[mm]", "depth[mm]", "through")
    return _table(
        head,
        (
            (
                bore.label,
                bore.purpose,
                *(f"{v:.4f}" for v in from_corner(fixture, bore.mouth)),
                f"{MM * bore.diameter:.3f}",
                f"{MM * bore.depth:.3f}",
                "yes" if bore.through else "no",
            )
            for bore in fixture.slab.bores
        ),
    )


def blocks_csv(fixture: Fixture) -> str:
    """Every block: its shape's letter, its place and turn on the plate, its height and mitre angle."""
    head = (
        *("target", "shape", "kind", "x[mm]", "y[mm]", "turn[deg]"),
        *("tilt[deg]", "height[mm]", "lowest_edge[mm]", "highest_edge[mm]", "side[mm]"),
    )
    rows = []
    for block in fixture.blocks:
        place = (*from_corner(fixture, block.pose[:3, 3]), np.rad2deg(block.azimuth), np.rad2deg(block.tilt))
        sizes = (MM * h for h in (block.height, *block.heights, block.side))
        numbers = (f"{v + 0.0:.4f}" for v in (*place, *sizes))
        rows.append((str(block.number), fixture.letter(block.number), str(block.kind), *numbers))
    return _table(head, rows)


def targets_csv(plate: Plate) -> str:
    """Poses of the tool at the targets in the robot's base, to full precision."""
    angles = np.rad2deg(se3.matrix_to_rpy(plate.poses[:, :3, :3]))
    places = MM * plate.poses[:, :3, 3]
    rows = np.column_stack([places, angles]).tolist()
    return _table(TARGET_COLUMNS, ((str(i), *map(repr, row)) for i, row in enumerate(rows, start=1)))


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return buffer.getvalue()
