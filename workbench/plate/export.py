"""All files of a plate in one folder: its own TOML, and workshop files added by extras.

A format whose optional library is missing is skipped and reported; the rest is written. Further formats stand
in records of parts:

    summary = PlateFile("summary", lambda plate: {"summary.txt": plate.name.encode()})
    wb.register(wb.Parts(plate_exports=[summary]))
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from workbench.base.errors import MissingExtraError, OptionError
from workbench.base.files import check_writable, write_folder
from workbench.base.progress import progress
from workbench.parts import PartTable
from workbench.plate.plate import Plate
from workbench.plate.plate_toml import plate_text

OWN_FILE = "plate.toml"
"""File name of the plate itself."""


@dataclass(frozen=True)
class PlateFile:
    """A format.

    Args:
        name: Name for `--formats`.
        write: Contents by file name.
        notes: Notes for whoever orders the plate.
    """

    name: str
    write: Callable[[Plate], dict[str, bytes]]
    notes: Callable[[Plate], tuple[str, ...]] = lambda plate: ()


PLATE_FILES: PartTable[PlateFile] = PartTable(
    "plate_exports", PlateFile, PlateFile("toml", lambda plate: {OWN_FILE: plate_text(plate).encode()})
)
"""Formats by their names for `--formats`."""


def formats_named(text: str) -> tuple[str, ...]:
    names = [name.strip().lower() for name in text.split(",") if name.strip()]
    if unknown := [name for name in names or [text] if name not in PLATE_FILES]:
        raise OptionError(f"unknown format '{unknown[0]}'; known: {', '.join(PLATE_FILES)}")
    return tuple(names)


class ExportedPlate(NamedTuple):
    """Result of a plate export.

    Args:
        missing: Formats that could not be written, and why.
        notes: Notes to read before the plate is made.
    """

    files: tuple[Path, ...]
    missing: dict[str, str]
    notes: tuple[str, ...]


def export_plate(plate: Plate, folder: Path | str, *, formats: Sequence[str] = ()) -> ExportedPlate:
    """Write a plate's files into a folder: all that can be written, or nothing if a format refuses the plate.

    Args:
        plate: Which is made as it is drawn.
        folder: Created if missing.
        formats: Formats to write; all if empty.
    """
    check_writable(folder, folder=True)
    wanted = [each for each in PLATE_FILES.values() if not formats or each.name in formats]
    files, missing, notes = dict[str, bytes](), dict[str, MissingExtraError](), list[str]()
    for number, each in enumerate(wanted):
        progress(number / len(wanted), f"writing {each.name}")
        try:
            files |= each.write(plate)
            notes += each.notes(plate)
        except MissingExtraError as error:
            missing[each.name] = error
    if not files:
        raise next(iter(missing.values()))
    written = write_folder(folder, files)
    progress(1.0, "done")
    paths = tuple(written / name for name in files)
    lacking = {name: str(error) for name, error in missing.items()}
    return ExportedPlate(paths, lacking, tuple(dict.fromkeys(notes)))
