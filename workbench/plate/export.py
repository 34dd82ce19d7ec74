"""All files of a plate in one folder: its own, and what a workshop needs, which extras add.

A format whose optional library is missing is skipped and reported; the rest is written. One more is an entry
point of `workbench.plate_exports`, or in a notebook

    PLATE_FILES.register(PlateFile("summary", lambda job: {"summary.txt": job.plate.name.encode()}))
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
from workbench.base.registry import Registry
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import plate_text
from workbench.plate.stock import Stock

OWN_FILE = "plate.toml"
"""The plate itself among its files."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PlateJob:
    """What is to be written.

    Args:
        plate: Which is made as it is drawn.
        stock: What it is made with.
        robot: The arm that it is for; None if not named.
        sigma: Standard deviations of a measurement on the plate [m], [rad]; usual ones if None.
        evaluation_poses: For which errors are predicted [rad or m]; those of the plate's region if None.
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
        name: What follows `--formats`.
        write: Contents by the names of files.
        is_usual: Whether it is written unless others are asked for.
        notes: What whoever orders the plate must know before.
    """

    name: str
    write: Callable[[PlateJob], dict[str, bytes]]
    is_usual: bool = True
    notes: Callable[[PlateJob], tuple[str, ...]] = lambda job: ()


PLATE_FILES: Registry[PlateFile] = Registry(
    "plate format",
    PlateFile,
    PlateFile("toml", lambda job: {OWN_FILE: plate_text(job.plate).encode()}),
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
        notes: What the files say that must be known before the plate is made.
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
    """Write a plate's files into a folder: all that can be written, or nothing where a format refuses it.

    Args:
        plate: Which is made as it is drawn.
        folder: Made if it is not there.
        formats: What to write; the usual ones if empty.
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
