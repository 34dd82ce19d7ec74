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
from workbench.data.readers.fields import Fields, to_numbers
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.table import Table, with_names
from workbench.data.readers.text import read_text

SPACING = 0.05
"""Distance of the two sockets' centres [m]."""
_POSE = re.compile(r"hole_\d+_pose\.csv")


@final
class Mukca(AbstractFileLayout):
    """A robot's folder with placements, one placement, or one socket's file."""

    name = "mukca"

    def matches(self, path: Path, head: bytes) -> bool:
        return bool(_sockets(path) if path.is_dir() else _POSE.fullmatch(path.name))

    def read(self, path: Path, naming: Naming | None) -> Fields:
        if _POSE.fullmatch(path.name):
            raise FileError(
                "these poses are the controller's own forward kinematics, not measurements: read the "
                "folder with hole_0.csv and hole_1.csv",
                path=str(path),
            )
        files = [path] if path.is_file() else _sockets(path)
        if not files:
            raise FileError("there are no hole_0.csv or hole_1.csv in this folder", path=str(path))
        tables = [_table(file) for file in files]
        width = len(tables[0].headings)
        if odd := next((table for table in tables if len(table.headings) != width), None):
            raise FileError(
                f"it has {len(odd.headings)} joints, the first file {width}: read one robot at a time",
                path=odd.source,
            )
        counts = [table.rows for table in tables]
        q = np.vstack([np.stack([to_numbers(t, i) for i in range(width)], axis=1) for t in tables])
        socket = np.repeat([int(file.name[5]) for file in files], counts)
        values = {f"q{i + 1}": q[:, i] for i in range(width)}
        units = dict.fromkeys(values, "rad")
        values |= {"x": SPACING * socket, "y": np.zeros(len(q)), "z": np.zeros(len(q))}
        values["session"] = np.repeat([file.parent.name for file in files], counts)
        values["point"] = np.array([f"socket{s}" for s in socket], dtype=str)
        notes = (
            "layout 'mukca': joint angles in rad, one session per placement",
            f"positions are not measured: socket 0 is at (0, 0, 0), socket 1 at ({SPACING}, 0, 0) m in a "
            "frame that differs between sessions, so base frames must be free per session",
        )
        lines = tuple(line for table in tables for line in table.lines)
        return Fields(source=str(path), lines=lines, values=values, units=units, notes=notes)


def _sockets(path: Path) -> list[Path]:
    """Files of sockets in a folder, or in those right below it."""
    return sorted((*path.glob("hole_[01].csv"), *path.glob("*/hole_[01].csv")))


def _table(path: Path) -> Table:
    grid = read_text(read_bytes(path), path)
    return with_names(grid, tuple(f"q{i}[rad]" for i in range(1, len(grid.rows[0]) + 1)))
