"""All files that are needed to make a plate, in one folder: solids, drawings, lists and the sheet.

Formats whose optional library is missing are skipped and reported; the rest is written.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from workbench.arm.robot import Robot
from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.files import check_folder, write_folder
from workbench.base.progress import Report
from workbench.plate.parts.csv_lists import (
    blocks_csv,
    bores_csv,
    distances_csv,
    holes_csv,
    inspection_csv,
    parts_csv,
    targets_csv,
)
from workbench.plate.parts.drawing import dxf_of, pdf_of
from workbench.plate.parts.drawing_set import pages_of
from workbench.plate.parts.fixture import fixture_of
from workbench.plate.parts.parts import Fixture
from workbench.plate.parts.sheet import PlateSheet
from workbench.plate.parts.solids import mesh_of, step_of, stl, three_mf
from workbench.plate.parts.stock import Stock
from workbench.plate.plate import Kind, Plate
from workbench.plate.score import score_plate
from workbench.plate.tolerances import Making


class Format(StrEnum):
    """What a plate is written as."""

    STL = "stl"
    THREE_MF = "3mf"
    DXF = "dxf"
    PDF = "pdf"
    CSV = "csv"
    STEP = "step"
    SHEET = "sheet"


LEAN = (Format.STL, Format.THREE_MF, Format.DXF, Format.PDF, Format.CSV, Format.SHEET)
"""Everything but STEP, whose library is a large download."""


def formats_named(text: str) -> tuple[Format, ...]:
    """Formats with commas between."""
    names = [name.strip().lower() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in list(Format)]
    if unknown or not names:
        raise OptionError(
            f"there is no format '{unknown[0] if unknown else text}'; known are {', '.join(Format)}"
        )
    return tuple(Format(name) for name in names)


class Exported(NamedTuple):
    """What was written.

    Args:
        files: Their files.
        missing: Formats that could not be written, and why.
    """

    fixture: Fixture
    files: tuple[Path, ...]
    missing: dict[Format, str]


def export_plate(
    plate: Plate,
    folder: Path | str,
    *,
    formats: Sequence[Format] = LEAN,
    robot: Robot | None = None,
    sigma: tuple[float, float] | None = None,
    stock: Stock | None = None,
    progress: Report | None = None,
) -> Exported:
    """Write a plate's files into a folder: all that can be written, or nothing where it can't be made.

    Args:
        plate: Which is made as it is drawn.
        folder: Made if it is not there.
        formats: What to write.
        robot: The arm that it is for: the sheet then says what accuracy to expect.
        sigma: Standard deviations of a measurement on the plate [m], [rad], for that; usual ones if None.

    Raises:
        OptionError: the plate can't be made; says why.
        MissingExtraError: every format needs a library that is not installed.
        FileError: the folder can't be written.
    """
    report = progress or (lambda part, words: None)
    check_folder(folder)
    stock = stock or Stock()
    fixture = fixture_of(plate, stock=stock)
    files: dict[str, bytes] = {}
    missing: dict[Format, MissingExtraError] = {}
    for number, kind in enumerate(kind for kind in Format if kind in formats and kind is not Format.SHEET):
        report(number / (len(Format) + 1), f"writing {kind}")
        try:
            files |= _WRITERS[kind](plate, fixture)
        except MissingExtraError as error:
            missing[kind] = error
    if Format.SHEET in formats:
        report(0.7, "drawing the sheet")
        score = None if robot is None else score_plate(robot, as_drawn(plate, fixture, stock), sigma=sigma)
        lacking = tuple(f"not written: {kind}; {error}" for kind, error in missing.items())
        sheet = PlateSheet(
            fixture=fixture, files=tuple(files), score=score, notes=(*fixture.notes, *plate.notes, *lacking)
        )
        files |= {"sheet.html": sheet.html().encode(), "sheet.pdf": sheet.pdf()}
    if not files:
        raise next(iter(missing.values()))
    written = write_folder(folder, files)
    report(1.0, "done")
    paths = tuple(written / name for name in files)
    return Exported(fixture, paths, {kind: str(error) for kind, error in missing.items()})


def as_drawn(plate: Plate, fixture: Fixture, stock: Stock) -> Plate:
    """The plate with what its drawings ask for: their tolerances, and the play of the pins in its seats."""
    asked = fixture.tolerances.making
    play = stock.play if any(t.kind is Kind.SEAT for t in plate.targets) else (0.0, 0.0)
    return replace(plate, making=Making(position=asked.position, angle=asked.angle, play=play))


def _lists(plate: Plate, fixture: Fixture) -> dict[str, bytes]:
    lists = {
        "holes": holes_csv(fixture),
        "blocks": blocks_csv(fixture),
        "bores": bores_csv(fixture),
        "targets": targets_csv(plate),
        "parts": parts_csv(fixture),
        "inspection": inspection_csv(plate, fixture),
    }
    if plate.anchors is not None:
        lists["distances"] = distances_csv(plate)
    return {f"{name}.csv": text.encode() for name, text in lists.items()}


_WRITERS: dict[Format, Callable[[Plate, Fixture], dict[str, bytes]]] = {
    Format.STL: lambda plate, fixture: {f"{name}.stl": stl(mesh_of(part)) for name, part in fixture.made},
    Format.THREE_MF: lambda plate, fixture: {"fixture.3mf": three_mf(fixture)},
    Format.DXF: lambda plate, fixture: {f"{p.name}.dxf": dxf_of(p).encode() for p in pages_of(fixture)},
    Format.PDF: lambda plate, fixture: {"drawings.pdf": pdf_of(pages_of(fixture))},
    Format.CSV: _lists,
    Format.STEP: lambda plate, fixture: {
        f"{name}.step": step_of(part, f"{plate.name} {name}") for name, part in fixture.made
    },
}
