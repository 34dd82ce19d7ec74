"""Everything that is needed to make a plate, in one folder."""

from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path

from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.folder import check_folder, write_folder
from workbench.plate.parts.drawing import dxf
from workbench.plate.parts.fixture import Stock, fixture_of
from workbench.plate.parts.lists import blocks_csv, holes_csv, targets_csv
from workbench.plate.parts.parts import Fixture
from workbench.plate.parts.sheet import PlateSheet
from workbench.plate.parts.solids import block_mesh, slab_mesh, stl, three_mf
from workbench.plate.parts.step import block_step, slab_step
from workbench.plate.plate import Plate
from workbench.plate.target_rows import SIGMA_POSITION, SIGMA_ROTATION
from workbench.plate.verbs import score_plate


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
