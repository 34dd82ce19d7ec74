"""Motion capture as text: OptiTrack's and Vicon's CSV, Qualisys' TSV. Each has several lines of headings.

OptiTrack Motive: a line of settings (`Format Version, …, Length Units, Meters`), lines `Type`, `Name`, `ID`
and `Rotation | Position` over every column, then `Frame, Time (Seconds), X, Y, Z, W, X, Y, Z, …`.
Vicon: `Objects`, `Segments` or `Trajectories`, the rate, names over the first column of each, `Frame,
Sub Frame, RX, RY, RZ[, RW], TX, TY, TZ` or `X, Y, Z`, a line of units.
Qualisys: keywords with values (`FREQUENCY 100`), names (`MARKER_NAMES` or `BODY_NAMES`), then rows, of a body
`X Y Z Roll Pitch Yaw Residual Rot[0] … Rot[8]`, in mm and degrees; the matrix stands column by column.

The columns of the tool get the headings of a plain table and are read like one. Orientations whose convention
a file does not state are left out, with a note.
"""

import re
from pathlib import Path
from typing import NamedTuple, final

from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.remedy import remedy
from workbench.base.wording import listed
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.table import grid_of, with_headings
from workbench.data.readers.text import decode

Columns = dict[int, str]
"""Headings by the places of columns, such as `{2: "qx", 6: "x[mm]"}`."""


class Take(NamedTuple):
    """What an instrument saw, frame by frame.

    Args:
        rows: Cells of every frame.
        time: Of every frame [s].
        bodies: Columns of the position, and of the orientation if it is stated, of each body by name.
        markers: Columns of the position of each marker by name.
        notes: Decisions, one sentence each.
    """

    rows: list[list[str]]
    time: list[str]
    bodies: dict[str, Columns]
    markers: dict[str, Columns]
    notes: list[str]

    def cells(self, columns: Columns) -> list[list[str]]:
        """Those of a body or marker by column; empty where it was lost, for which Qualisys writes zeros."""
        place = [k for k, heading in columns.items() if heading[0] in "xyz"]
        lost = [not any(row[k].strip("-+0.eE") for k in place) for row in self.rows]
        return [[row[k] * (not out) for row, out in zip(self.rows, lost, strict=True)] for k in columns]


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
        """Columns of the tool: the body that was chosen or the only one, else every marker."""
        text = decode(read_bytes(path), path)[0].lstrip("\ufeff")
        mark = ";" if text.count(";", 0, 2000) > text.count(",", 0, 2000) else ","
        mark = "\t" if text.startswith(("NO_OF", "FILE_V")) else mark
        rows = [[cell.strip().strip('"') for cell in line.split(mark)] for line in text.splitlines()]
        read = _qualisys if mark == "\t" else _optitrack if text.startswith("Format") else _vicon
        try:
            take = read(rows)
        except (IndexError, ValueError, KeyError, StopIteration) as error:
            raise FileError(
                f"is not a complete export of a take ({type(error).__name__}): export it again with headings",
                path=str(path),
            ) from None
        tools, note = take.markers, f"markers m1 … m{len(take.markers)} are {listed(list(take.markers))}"
        if take.bodies:
            name = chosen(list(take.bodies), naming, f"{path}: bodies", "pose")
            tools, note = {name: take.bodies[name]}, f"the tool is the body '{name}'"
        elif len(tools) == 1:
            note = f"the tool is the marker '{next(iter(tools))}'"
        elif not tools:
            raise DataError(f"{path}: there are neither bodies nor markers in this recording")
        headings, columns = ["time[s]"], [take.time]
        for number, own in enumerate(tools.values(), 1):
            headings += [f"m{number}{heading}" if len(tools) > 1 else heading for heading in own.values()]
            columns += take.cells(own)
        notes = [f"layout '{self.name}'", *take.notes, note]
        return fields_of(with_headings(grid_of(headings, columns, source=str(path), notes=notes)))


def _table(rows: list[list[str]], width: int) -> list[list[str]]:
    """The frames, as far as they go on without an empty line."""
    end = next((k for k, row in enumerate(rows) if not row or not row[0]), len(rows))
    if not end:
        raise ValueError("no frames")
    return [(row + [""] * width)[:width] for row in rows[:end]]


def _rate(text: str) -> float:
    rate = float(text)
    if not 0.0 < rate < 1e6:
        raise ValueError(f"{rate} frames a second")
    return rate


def _optitrack(rows: list[list[str]]) -> Take:
    settings = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = {"Meters": "m", "Millimeters": "mm", "Centimeters": "cm"}[settings.get("Length Units", "Meters")]
    start = next(i for i, row in enumerate(rows) if row[:1] == ["Frame"])
    above = {row[1]: row for row in rows[1:start] if len(row) > 2 and row[1] in ("Type", "Name")}
    parts = next(row for row in rows[1:start] if "Position" in row)
    kinds, names, axes = above["Type"], above["Name"], rows[start]
    data = _table(rows[start + 1 :], len(axes))
    headings, notes = {("Position", a): f"{a.lower()}[{unit}]" for a in "XYZ"}, list[str]()
    notes.append(f"lengths in {unit}, as the file states")
    if settings.get("Rotation Type", "Quaternion") == "Quaternion":
        headings |= {("Rotation", a): f"q{a.lower()}" for a in "WXYZ"}
    else:
        notes.append("orientations are left out: export them again with rotation type Quaternion")
    found: dict[str, dict[str, Columns]] = {"Rigid Body": {}, "Marker": {}}
    for i in range(2, len(axes)):
        if kinds[i] in found and (parts[i], axes[i]) in headings:
            found[kinds[i]].setdefault(names[i], {})[i] = headings[parts[i], axes[i]]
    return Take(data, [row[1] for row in data], found["Rigid Body"], found["Marker"], notes)


def _vicon(rows: list[list[str]]) -> Take:
    rate, names, axes, units = _rate(rows[1][0]), rows[2], rows[3], rows[4]
    data = _table(rows[5:], len(axes))
    starts = [i for i in range(2, len(axes)) if i < len(names) and names[i]]
    bodies, markers, notes = dict[str, Columns](), dict[str, Columns](), [f"{rate:g} frames a second"]
    for first, last in zip(starts, [*starts[1:], len(axes)], strict=True):
        place, name = {axes[i]: i for i in range(first, last)}, names[first]
        mark = "" if "X" in place else "T"
        at = {axis: place[f"{mark}{axis}"] for axis in "XYZ"}
        own = {i: f"{axis.lower()}[{units[i]}]" for axis, i in at.items()}
        if not mark:
            markers[name] = own
        elif "RW" in place:
            bodies[name] = own | {place[f"R{a}"]: f"q{a.lower()}" for a in "WXYZ"}
        else:
            bodies[name] = own
            notes.append(f"angles of '{name}' are left out: their order is not stated")
    time = [repr((float(row[0]) - float(data[0][0])) / rate) for row in data]
    return Take(data, time, bodies, markers, notes)


def _qualisys(rows: list[list[str]]) -> Take:
    head = {row[0]: row[1:] for row in rows[:40] if row and re.fullmatch(r"[A-Z_]+", row[0])}
    rate = _rate(head["FREQUENCY"][0])
    start = max(i for i, row in enumerate(rows[:40]) if row[0] in head) + 1
    while not re.fullmatch(r"[-+\d.eE]+", rows[start][0]):
        start += 1
    counted, is_body = rows[start - 1][0] == "Frame", "BODY_NAMES" in head
    names = [name for name in head.get("BODY_NAMES", head.get("MARKER_NAMES", [])) if name]
    headings = {i: f"{axis}[mm]" for i, axis in enumerate("xyz")}
    headings |= {7 + i: f"r{i % 3 + 1}{i // 3 + 1}" for i in range(9 * is_body)}
    each, first = 16 if is_body else 3, 2 * counted
    data = _table(rows[start:], first + each * len(names))
    tools = {name: {first + k * each + i: h for i, h in headings.items()} for k, name in enumerate(names)}
    time = [row[1] if counted else repr(k / rate) for k, row in enumerate(data)]
    notes = [f"{rate:g} frames a second, positions in mm"]
    return Take(data, time, tools if is_body else {}, {} if is_body else tools, notes)


def chosen(names: list[str], naming: Naming | None, what: str, key: str) -> str:
    """The only body, topic or frame of a recording, or that which `--columns "key=NAME"` chooses."""
    pairs = naming.pairs if naming is not None else ()
    wanted = next((pair.right[0].name for pair in pairs if pair.left.name == key), None)
    if wanted in names:
        return wanted
    if wanted is None and len(names) == 1:
        return names[0]
    why = f"'{wanted}' is none of them" if wanted is not None else "more than one"
    elsewhere = "choose with 'workbench identify --columns', or load a CSV here"
    how = remedy(f'choose with columns="{key}=NAME" (--columns)', page=elsewhere)
    raise OptionError(f"{what} {listed(names)}: {why}; {how}")
