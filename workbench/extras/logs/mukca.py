"""A ball put into two sockets 50 mm apart: `<placement>/hole_0.csv` and `hole_1.csv` hold joint angles only.

Each placement of the sockets is a session with a frame of its own: socket 0 at its origin, socket 1 at
(0.05, 0, 0) m. Where that frame lies in the robot's base is unknown, and its rotation about the line
through both sockets can't be seen.
"""

import re
from pathlib import Path
from typing import final

import numpy as np

from workbench.base.errors import FileError
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Decimal, Fields, to_numbers
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.layouts.layout import AbstractFileLayout
from workbench.data.readers.table import Table, with_names
from workbench.data.readers.text import read_text

SPACING = 0.05
"""Distance of the two sockets' centres [m]."""
_HOLE = re.compile(r"hole_([01])\.csv")
_POSE = re.compile(r"hole_\d+_pose\.csv")


@final
class Mukca(AbstractFileLayout):
    """A robot's folder with placements, one placement, or one socket's file."""

    name = "mukca"

    def matches(self, path: Path, head: bytes) -> bool:
        return bool(_placements(path) if path.is_dir() else _POSE.fullmatch(path.name))

    def read(self, path: Path, naming: Naming | None) -> Fields:
        if _POSE.fullmatch(path.name):
            raise FileError(
                "these poses are the controller's own forward kinematics, not measurements: read the "
                "folder with hole_0.csv and hole_1.csv",
                path=str(path),
            )
        placements = {path.parent: [path]} if path.is_file() else _placements(path)
        if not placements:
            raise FileError("there are no hole_0.csv or hole_1.csv in this folder", path=str(path))
        tables = [
            (place.name, int(file.name[5]), _table(file))
            for place in placements
            for file in placements[place]
        ]
        width = len(tables[0][2].headings)
        for _, _, table in tables:
            if len(table.headings) != width:
                raise FileError(
                    f"it has {len(table.headings)} joints where the first file has {width}: "
                    "read one robot at a time",
                    path=table.source,
                )
        return _joined(tables, width, path)


def _placements(path: Path) -> dict[Path, list[Path]]:
    """Folders with their socket files: the folder itself, or those right below it."""
    folders = [path, *sorted(p for p in path.iterdir() if p.is_dir())]
    found = {folder: sorted(f for f in folder.iterdir() if _HOLE.fullmatch(f.name)) for folder in folders}
    return {folder: files for folder, files in found.items() if files}


def _table(path: Path) -> Table:
    grid = read_text(read_bytes(path), path)
    names = tuple(f"q{i}[rad]" for i in range(1, len(grid.rows[0]) + 1))
    return with_names(grid, names)


def _joined(tables: list[tuple[str, int, Table]], width: int, path: Path) -> Fields:
    """One set of columns from all files, with session and socket of each row."""
    columns = [
        np.stack([to_numbers(t, i, Decimal.POINT) for i in range(width)], axis=1) for _, _, t in tables
    ]
    counts = [t.rows for _, _, t in tables]
    q = np.vstack(columns)
    socket = np.repeat([s for _, s, _ in tables], counts)
    values = {f"q{i + 1}": q[:, i] for i in range(width)}
    values |= {"x": SPACING * socket, "y": np.zeros(len(q)), "z": np.zeros(len(q))}
    values["session"] = np.repeat([place for place, _, _ in tables], counts)
    values["point"] = np.array([f"socket{s}" for s in socket], dtype=str)
    notes = (
        "layout 'mukca': joint angles in rad, one session per placement",
        f"positions are not measured: socket 0 is at (0, 0, 0), socket 1 at ({SPACING}, 0, 0) m in a frame "
        "that differs between sessions, so base frames must be free per session",
    )
    units = {f"q{i + 1}": "rad" for i in range(width)}
    lines = tuple(line for _, _, t in tables for line in t.lines)
    return Fields(source=str(path), lines=lines, values=values, units=units, notes=notes)
