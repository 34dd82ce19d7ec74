"""All files that are needed to make a plate, in one folder: solids, drawing, lists and the sheet.

The lists are for workshop and measuring room. Positions on the plate count from the lower left corner of its
top face, as in the drawing, along the plate's x and y axes. Targets are poses of the tool in the robot's
base, R = Rz(yaw) Ry(pitch) Rx(roll), in the columns that an as-measured plate is read from.
"""

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from pathlib import Path

import numpy as np

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.base.files import check_folder, write_folder
from workbench.plate.parts.fixture import Stock, fixture_of
from workbench.plate.parts.hole_drawing import dxf
from workbench.plate.parts.parts import Fixture
from workbench.plate.parts.sheet import PlateSheet
from workbench.plate.parts.solids import block_mesh, block_step, slab_mesh, slab_step, stl, three_mf
from workbench.plate.plate import Plate
from workbench.plate.readings import SIGMA_POSITION, SIGMA_ROTATION
from workbench.plate.score import score_plate

TARGET_COLUMNS = ("target", "x[mm]", "y[mm]", "z[mm]", "roll[deg]", "pitch[deg]", "yaw[deg]")
MM = 1e3


def holes_csv(fixture: Fixture) -> str:
    """Every hole of the plate: label, what it is, place from the lower left corner, diameter, depth."""
    head = ("hole", "purpose", "x[mm]", "y[mm]", "diameter[mm]", "depth[mm]", "through")
    return _table(
        head,
        (
            (
                bore.label,
                bore.purpose,
                *(f"{v:.4f}" for v in fixture.from_corner(bore.mouth)),
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
        place = (*fixture.from_corner(block.pose[:3, 3]), np.rad2deg(block.azimuth), np.rad2deg(block.tilt))
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


class Format(StrEnum):
    """What a plate is written as."""

    STL = "stl"
    THREE_MF = "3mf"
    DXF = "dxf"
    CSV = "csv"
    STEP = "step"
    SHEET = "sheet"


LEAN = (Format.STL, Format.THREE_MF, Format.DXF, Format.CSV, Format.SHEET)
"""Everything but STEP, whose library is a large download."""


def formats_named(text: str) -> tuple[Format, ...]:
    """Formats with commas between.

    Raises:
        OptionError: one is unknown.
    """
    names = [name.strip().lower() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in list(Format)]
    if unknown or not names:
        raise OptionError(
            f"there is no format '{unknown[0] if unknown else text}'; known are {', '.join(Format)}"
        )
    return tuple(Format(name) for name in names)


def export_plate(
    plate: Plate,
    folder: Path | str,
    *,
    formats: Sequence[Format] = LEAN,
    robot: Robot | None = None,
    sigma: tuple[float, float] = (SIGMA_POSITION, SIGMA_ROTATION),
    stock: Stock | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> tuple[Fixture, tuple[Path, ...]]:
    """Write a plate's files into a folder: all of them, or nothing.

    Args:
        plate: Which is made as it is drawn.
        folder: Made if it is not there.
        formats: What to write.
        robot: The arm that it is for: the sheet then says what accuracy to expect.
        sigma: Standard deviations of a measurement on the plate [m], [rad], for that.
        stock: Bar, screws and pins.
        progress: Called with the part done and what is being done.

    Returns:
        The parts and the files' paths.

    Raises:
        OptionError: the plate can't be made; says why.
        MissingExtraError: a format needs a library that is not installed.
        FileError: the folder can't be written.
    """
    report = progress or (lambda part, words: None)
    check_folder(folder)
    fixture = fixture_of(plate, stock=stock)
    files: dict[str, bytes] = {}
    for number, kind in enumerate(kind for kind in Format if kind in formats and kind is not Format.SHEET):
        report(number / (len(Format) + 1), f"writing {kind}")
        files |= _WRITERS[kind](plate, fixture)
    if Format.SHEET in formats:
        report(0.7, "drawing the sheet")
        score = None if robot is None else score_plate(robot, plate, sigma=sigma)
        sheet = PlateSheet(
            fixture=fixture, files=tuple(files), score=score, notes=(*fixture.notes, *plate.notes)
        )
        files |= {"sheet.html": sheet.html().encode(), "sheet.pdf": sheet.pdf()}
    written = write_folder(folder, files)
    report(1.0, "done")
    return fixture, tuple(written / name for name in files)


def _meshes(plate: Plate, fixture: Fixture) -> dict[str, bytes]:
    blocks = {f"block-{s.letter}.stl": stl(block_mesh(s.block)) for s in fixture.shapes}
    return {"plate.stl": stl(slab_mesh(fixture.slab)), **blocks}


def _steps(plate: Plate, fixture: Fixture) -> dict[str, bytes]:
    blocks = {
        f"block-{s.letter}.step": block_step(s.block, f"{plate.name} block {s.letter}")
        for s in fixture.shapes
    }
    return {"plate.step": slab_step(fixture.slab, f"{plate.name} plate"), **blocks}


def _lists(plate: Plate, fixture: Fixture) -> dict[str, bytes]:
    lists = {"holes": holes_csv(fixture), "blocks": blocks_csv(fixture), "targets": targets_csv(plate)}
    return {f"{name}.csv": text.encode() for name, text in lists.items()}


_WRITERS: dict[Format, Callable[[Plate, Fixture], dict[str, bytes]]] = {
    Format.STL: _meshes,
    Format.THREE_MF: lambda plate, fixture: {"fixture.3mf": three_mf(fixture)},
    Format.DXF: lambda plate, fixture: {"plate.dxf": dxf(fixture).encode()},
    Format.CSV: _lists,
    Format.STEP: _steps,
}
