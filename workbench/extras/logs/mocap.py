"""Motion capture as text: OptiTrack's and Vicon's CSV, Qualisys' TSV. Each has several lines of headings.

OptiTrack Motive: a line of settings (`Format Version, …, Length Units, Meters`), lines `Type`, `Name`, `ID`
and `Rotation | Position` over every column, then `Frame, Time (Seconds), X, Y, Z, W, X, Y, Z, …`.
Vicon: `Objects`, `Segments` or `Trajectories`, the rate, names over the first column of each, `Frame,
Sub Frame, RX, RY, RZ[, RW], TX, TY, TZ` or `X, Y, Z`, a line of units.
Qualisys: keywords with values (`FREQUENCY 100`), names (`MARKER_NAMES` or `BODY_NAMES`), then rows, of a body
`X Y Z Roll Pitch Yaw Residual Rot[0] … Rot[8]`, in mm and degrees; the matrix stands column by column.

Orientations whose convention a file does not state are left out, with a note.
"""

import re
from pathlib import Path
from typing import final

import numpy as np

from workbench.base import se3
from workbench.base.errors import FileError
from workbench.base.units import Quantity, to_si
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.text import decode
from workbench.extras.logs.recording import Logged

LOST = 1e-9
"""A body or marker this near to the origin was not seen: Qualisys writes zeros [m]."""


@final
class Mocap(AbstractFileLayout):
    """A take that was exported as text."""

    name = "mocap"

    def matches(self, path: Path, head: bytes) -> bool:
        start = head.lstrip(b"\xef\xbb\xbf")
        return bool(
            start.startswith((b"Format Version,", b"NO_OF_FRAMES\t", b"FILE_VERSION\t"))
            or re.match(rb"(Objects|Segments|Trajectories)[,;]*\r?\n\d+(\.\d+)?[,;]*\r?\n", start)
        )

    def read(self, path: Path, naming: Naming | None) -> Fields:
        text = decode(read_bytes(path), path)[0].lstrip("\ufeff")
        mark = ";" if text.count(";", 0, 2000) > text.count(",", 0, 2000) else ","
        mark = "\t" if text.startswith(("NO_OF", "FILE_V")) else mark
        rows = [[cell.strip().strip('"') for cell in line.split(mark)] for line in text.splitlines()]
        read = _qualisys if mark == "\t" else _optitrack if text.startswith("Format") else _vicon
        try:
            recording = read(rows, path)
        except (IndexError, ValueError, KeyError, StopIteration) as error:
            raise FileError(
                f"is not a complete export of a take ({type(error).__name__}): export it again with headings",
                path=str(path),
            ) from None
        return recording.fields(path, self.name, naming)


def _table(rows: list[list[str]], width: int) -> np.ndarray:
    numbers = []
    for row in rows:
        if not row or not row[0]:
            break
        cells = (row + [""] * width)[:width]
        numbers.append([float(cell) if cell and cell.lower() != "nan" else np.nan for cell in cells])
    found = np.array(numbers).reshape(-1, width)
    if np.isinf(found).any() or not len(found):
        raise ValueError("no rows of finite numbers")
    return found


def _rate(text: str) -> float:
    rate = float(text)
    if not 0.0 < rate < 1e6:
        raise ValueError(f"{rate} frames a second")
    return rate


def _optitrack(rows: list[list[str]], path: Path) -> Logged:
    settings = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = {"Meters": "m", "Millimeters": "mm", "Centimeters": "cm"}[settings.get("Length Units", "Meters")]
    start = next(i for i, row in enumerate(rows) if row[:1] == ["Frame"])
    above = {row[1]: row for row in rows[1:start] if len(row) > 2 and row[1] in ("Type", "Name")}
    parts = next(row for row in rows[1:start] if "Position" in row)
    kinds, names, axes = above["Type"], above["Name"], rows[start]
    data = _table(rows[start + 1 :], len(axes))
    columns: dict[tuple[str, str], dict[str, int]] = {}
    for i in range(2, len(axes)):
        columns.setdefault((kinds[i], names[i]), {})[f"{parts[i]} {axes[i]}"] = i
    bodies, markers, notes = {}, {}, [f"lengths in {unit}, as the file states"]
    turned = settings.get("Rotation Type", "Quaternion") == "Quaternion"
    if not turned:
        notes.append("orientations are left out: export them again with rotation type Quaternion")
    for (kind, name), place in columns.items():
        position = to_si(data[:, [place[f"Position {a}"] for a in "XYZ"]], unit, Quantity.LENGTH)
        if kind == "Rigid Body":
            bodies[name] = position, _turns(data, place, "Rotation {}") if turned else None
        elif kind == "Marker":
            markers[name] = position
    return Logged(time=data[:, 1], bodies=bodies, markers=markers, notes=tuple(notes))


def _vicon(rows: list[list[str]], path: Path) -> Logged:
    rate, names, axes, units = _rate(rows[1][0]), rows[2], rows[3], rows[4]
    data = _table(rows[5:], len(axes))
    starts = [i for i in range(2, len(axes)) if i < len(names) and names[i]]
    bodies, markers, notes = {}, {}, [f"{rate:g} frames a second"]
    for first, last in zip(starts, [*starts[1:], len(axes)], strict=True):
        place, name = {axes[i]: i for i in range(first, last)}, names[first]
        keys = [("TX", "TY", "TZ"), ("X", "Y", "Z")]["X" in place]
        position = to_si(data[:, [place[k] for k in keys]], units[place[keys[0]]], Quantity.LENGTH)
        if keys[0] == "X":
            markers[name] = position
            continue
        if "RW" not in place:
            notes.append(f"angles of '{name}' are left out: their order is not stated")
        bodies[name] = position, _turns(data, place, "R{}") if "RW" in place else None
    time = (data[:, 0] - data[0, 0]) / rate
    return Logged(time=time, bodies=bodies, markers=markers, notes=tuple(notes))


def _qualisys(rows: list[list[str]], path: Path) -> Logged:
    head = {row[0]: row[1:] for row in rows[:40] if row and re.fullmatch(r"[A-Z_]+", row[0])}
    rate = _rate(head["FREQUENCY"][0])
    start = max(i for i, row in enumerate(rows[:40]) if row[0] in head) + 1
    while not re.fullmatch(r"[-+\d.eE]+", rows[start][0]):
        start += 1
    counted = rows[start - 1][0] == "Frame"
    names = [name for name in head.get("BODY_NAMES", head.get("MARKER_NAMES", [])) if name]
    each = 16 if "BODY_NAMES" in head else 3
    data = _table(rows[start:], 2 * counted + each * len(names))
    time = data[:, 1] if counted else np.arange(len(data)) / rate
    bodies, markers = {}, {}
    for k, name in enumerate(names):
        part = data[:, 2 * counted + k * each :][:, :each]
        position = 1e-3 * part[:, :3]
        position[np.linalg.norm(position, axis=1) < LOST] = np.nan
        if each == 3:
            markers[name] = position
            continue
        seen = np.isfinite(position).all(axis=1)
        turns = np.full((len(part), 3, 3), np.nan)
        nine = part[seen, 7:16].reshape(-1, 3, 3).swapaxes(1, 2)
        if len(nine) and not np.allclose(nine @ nine.swapaxes(1, 2), np.eye(3), atol=0.01):
            raise ValueError(f"the matrices of '{name}' are no rotations")
        turns[seen] = se3.rotvec_to_matrix(se3.matrix_to_rotvec(nine))
        bodies[name] = position, turns
    notes = (f"{rate:g} frames a second, positions in mm",)
    return Logged(time=time, bodies=bodies, markers=markers, notes=notes)


def _turns(data: np.ndarray, place: dict[str, int], key: str) -> np.ndarray:
    """Rotation matrices from quaternions, NaN where there are none."""
    wxyz = data[:, [place[key.format(part)] for part in "WXYZ"]]
    length = np.linalg.norm(wxyz, axis=1)
    seen = np.isfinite(length) & (length > 0.5)
    turns = np.full((len(data), 3, 3), np.nan)
    turns[seen] = se3.quaternion_to_matrix(wxyz[seen] / length[seen, None])
    return turns
