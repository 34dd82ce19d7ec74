"""All files that are needed to make a plate, in one folder: solids, lists, and what extras add.

A format whose optional library is missing is skipped and reported; the rest is written. One more is an entry
point of `workbench.plate_exports`, or in a notebook

    PLATE_FILES.register(PlateFile("summary", lambda job: {"summary.txt": job.plate.name.encode()}))
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from workbench.arm.robot import Robot
from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.files import check_folder, write_folder
from workbench.base.progress import progress
from workbench.base.registry import Registry
from workbench.plate.parts.csv_lists import (
    blocks_csv,
    bores_csv,
    distances_csv,
    holes_csv,
    parts_csv,
    targets_csv,
)
from workbench.plate.parts.fixture import fixture_of
from workbench.plate.parts.parts import Fixture
from workbench.plate.parts.solids import mesh_of, stl
from workbench.plate.parts.stock import Stock
from workbench.plate.plate import Kind, Plate
from workbench.plate.tolerances import Production


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateJob:
    """What is to be written.

    Args:
        plate: As it was given.
        fixture: Its parts.
        drawn: The plate with what its drawings ask for: their tolerances, and the play of pins in seats.
        robot: The arm that it is for; None if not named.
        sigma: Standard deviations of a measurement on the plate [m], [rad]; usual ones if None.
    """

    plate: Plate
    fixture: Fixture
    drawn: Plate
    robot: Robot | None
    sigma: tuple[float, float] | None


@dataclass(frozen=True)
class PlateFile:
    """A format.

    Args:
        name: What follows `--formats`.
        write: Contents by the names of files.
        is_usual: Whether it is written unless others are asked for.
    """

    name: str
    write: Callable[[PlateJob], dict[str, bytes]]
    is_usual: bool = True


def _solids(job: PlateJob) -> dict[str, bytes]:
    return {f"{name}.stl": stl(mesh_of(part)) for name, part in job.fixture.made}


def _lists(job: PlateJob) -> dict[str, bytes]:
    fixture, plate = job.fixture, job.plate
    lists = {"holes": holes_csv(fixture), "blocks": blocks_csv(fixture), "bores": bores_csv(fixture)}
    lists |= {"targets": targets_csv(plate), "parts": parts_csv(fixture)}
    if plate.anchors is not None:
        lists["distances"] = distances_csv(plate)
    return {f"{name}.csv": text.encode() for name, text in lists.items()}


PLATE_FILES: Registry[PlateFile] = Registry(
    "plate format",
    PlateFile,
    PlateFile("stl", _solids),
    PlateFile("csv", _lists),
    group="workbench.plate_exports",
)
"""Formats by what follows `--formats`."""


def formats_named(text: str) -> tuple[str, ...]:
    names = [name.strip().lower() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in PLATE_FILES]
    if unknown or not names:
        raise OptionError(
            f"unknown format '{unknown[0] if unknown else text}'; known: {', '.join(PLATE_FILES)}"
        )
    return tuple(names)


class ExportedPlate(NamedTuple):
    """What was written.

    Args:
        files: Their files.
        missing: Formats that could not be written, and why.
    """

    fixture: Fixture
    files: tuple[Path, ...]
    missing: dict[str, str]


def export_plate(
    plate: Plate,
    folder: Path | str,
    *,
    formats: Sequence[str] = (),
    robot: Robot | None = None,
    sigma: tuple[float, float] | None = None,
    stock: Stock | None = None,
) -> ExportedPlate:
    """Write a plate's files into a folder: all that can be written, or nothing where it can't be made.

    Args:
        plate: Which is made as it is drawn.
        folder: Made if it is not there.
        formats: What to write; the usual ones if empty.
        robot: The arm that it is for.
        sigma: Standard deviations of a measurement on the plate [m], [rad]; usual ones if None.
    """
    check_folder(folder)
    stock = stock or Stock()
    fixture = fixture_of(plate, stock=stock)
    drawn = as_drawn(plate, fixture, stock)
    job = PlateJob(plate=plate, fixture=fixture, drawn=drawn, robot=robot, sigma=sigma)
    wanted = [each for each in PLATE_FILES.values() if (each.name in formats if formats else each.is_usual)]
    files: dict[str, bytes] = {}
    missing: dict[str, MissingExtraError] = {}
    for number, each in enumerate(wanted):
        progress(number / len(wanted), f"writing {each.name}")
        try:
            files |= each.write(job)
        except MissingExtraError as error:
            missing[each.name] = error
    if not files:
        raise next(iter(missing.values()))
    written = write_folder(folder, files)
    progress(1.0, "done")
    paths = tuple(written / name for name in files)
    return ExportedPlate(fixture, paths, {name: str(error) for name, error in missing.items()})


def as_drawn(plate: Plate, fixture: Fixture, stock: Stock) -> Plate:
    """The plate with what its drawings ask for: their tolerances, and the play of the pins in its seats."""
    requested = fixture.tolerances.production
    play = stock.play if any(t.kind is Kind.SEAT for t in plate.targets) else (0.0, 0.0)
    return replace(
        plate, production=Production(position=requested.position, angle=requested.angle, play=play)
    )
