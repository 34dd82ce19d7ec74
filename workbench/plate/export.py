"""All files of a plate in one folder: its own TOML, and workshop files added by extras.

A format whose optional library is missing is skipped and reported; the rest is written. Further formats stand
in records of parts:

    summary = PlateFile("summary", lambda job: {"summary.txt": job.plate.name.encode()})
    wb.register(wb.Parts(plate_exports=[summary]))
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.files import check_folder, write_folder
from workbench.base.progress import progress
from workbench.parts import PartTable
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import plate_text
from workbench.plate.stock import Stock

OWN_FILE = "plate.toml"
"""File name of the plate itself."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateJob:
    """Input of plate exports.

    Args:
        plate: The plate as drawn.
        stock: Material and standard parts.
        robot: The arm that it is for; None if not given.
        sigma: Standard deviations of a measurement on the plate [m], [rad]; typical ones if None.
        evaluation_poses: Poses for predicted errors [rad or m]; those of the plate's region if None.
    """

    plate: Plate
    stock: Stock
    robot: Robot | None
    sigma: tuple[float, float] | None
    evaluation_poses: Float[np.ndarray, "rows n"] | None


@dataclass(frozen=True)
class PlateFile:
    """A format.

    Args:
        name: Name for `--formats`.
        write: Contents by file name.
        is_usual: Whether it is written by default.
        notes: Notes for whoever orders the plate.
    """

    name: str
    write: Callable[[PlateJob], dict[str, bytes]]
    is_usual: bool = True
    notes: Callable[[PlateJob], tuple[str, ...]] = lambda job: ()


PLATE_FILES: PartTable[PlateFile] = PartTable(
    "plate_exports", PlateFile, PlateFile("toml", lambda job: {OWN_FILE: plate_text(job.plate).encode()})
)
"""Formats by their names for `--formats`."""


def formats_named(text: str) -> tuple[str, ...]:
    names = [name.strip().lower() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in PLATE_FILES]
    if unknown or not names:
        raise OptionError(
            f"unknown format '{unknown[0] if unknown else text}'; known: {', '.join(PLATE_FILES)}"
        )
    return tuple(names)


class ExportedPlate(NamedTuple):
    """Result of a plate export.

    Args:
        files: Files that were written.
        missing: Formats that could not be written, and why.
        notes: Notes to read before the plate is made.
    """

    files: tuple[Path, ...]
    missing: dict[str, str]
    notes: tuple[str, ...]


def export_plate(
    plate: Plate,
    folder: Path | str,
    *,
    formats: Sequence[str] = (),
    robot: Robot | None = None,
    sigma: tuple[float, float] | None = None,
    stock: Stock | None = None,
    evaluation_poses: Float[np.ndarray, "rows n"] | None = None,
) -> ExportedPlate:
    """Write a plate's files into a folder: all that can be written, or nothing if a format refuses the plate.

    Args:
        plate: Which is made as it is drawn.
        folder: Created if missing.
        formats: Formats to write; the usual ones if empty.
        robot: The arm that it is for.
        sigma: Standard deviations of a measurement on the plate [m], [rad]; usual ones if None.
        stock: What it is made with; the usual one if None.
        evaluation_poses: For which errors are predicted [rad or m]; those of the plate's region if None.
    """
    check_folder(folder)
    job = PlateJob(
        plate=plate, stock=stock or Stock(), robot=robot, sigma=sigma, evaluation_poses=evaluation_poses
    )
    wanted = [each for each in PLATE_FILES.values() if (each.name in formats if formats else each.is_usual)]
    files: dict[str, bytes] = {}
    missing: dict[str, MissingExtraError] = {}
    notes: list[str] = []
    for number, each in enumerate(wanted):
        progress(number / len(wanted), f"writing {each.name}")
        try:
            files |= each.write(job)
            notes += each.notes(job)
        except MissingExtraError as error:
            missing[each.name] = error
    if not files:
        raise next(iter(missing.values()))
    written = write_folder(folder, files)
    progress(1.0, "done")
    paths = tuple(written / name for name in files)
    lacking = {name: str(error) for name, error in missing.items()}
    return ExportedPlate(paths, lacking, tuple(dict.fromkeys(notes)))
