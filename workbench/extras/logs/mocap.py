"""Motion capture as text: takes that OptiTrack's Motive exports as CSV.

A line of settings (`Format Version, …, Length Units, Meters`), lines of every column's type, name, ID and
`Rotation | Position`, then `Frame, Time (Seconds), X, Y, Z, W, X, Y, Z, …`. The columns of the tool get the
headings of a plain table and are read like one.
"""

from pathlib import Path
from typing import final

from workbench.base.errors import DataError, FileError, OptionError
from workbench.base.remedy import remedy
from workbench.base.wording import listed
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.layouts import AbstractFileLayout
from workbench.data.readers.table import grid_of, with_headings
from workbench.data.readers.text import decode

UNITS = {"Meters": "m", "Millimeters": "mm", "Centimeters": "cm"}


@final
class Mocap(AbstractFileLayout):
    """A take; the tool is the body that was chosen or the only one, else every marker."""

    name = "mocap"

    def matches(self, path: Path, head: bytes) -> bool:
        return head.removeprefix(b"\xef\xbb\xbf").startswith(b"Format Version,")

    def read(self, path: Path, naming: Naming | None) -> Fields:
        text = decode(read_bytes(path), path)[0].lstrip("\ufeff")
        mark = ";" if text.count(";", 0, 2000) > text.count(",", 0, 2000) else ","
        rows = [[cell.strip().strip('"') for cell in line.split(mark)] for line in text.splitlines()]
        try:
            bodies, markers, frames, notes = _parts(rows)
        except (IndexError, KeyError, StopIteration):
            text = "is not a complete export of a take: export it again from Motive, with all its headings"
            raise FileError(text, path=str(path)) from None
        tools, note = markers, f"markers m1 … m{len(markers)} are {listed(list(markers))}"
        if bodies:
            name = chosen(list(bodies), naming, f"{path}: bodies", "pose")
            tools, note = {name: bodies[name]}, f"the tool is the body '{name}'"
        elif len(tools) == 1:
            note = f"the tool is the marker '{next(iter(tools))}'"
        elif not tools:
            raise DataError(f"{path}: there are neither bodies nor markers in this recording")
        headings, columns = ["time[s]"], [[row[1] for row in frames]]
        for number, own in enumerate(tools.values(), 1):
            headings += [f"m{number}{heading}" if len(tools) > 1 else heading for heading in own.values()]
            columns += [[row[k] for row in frames] for k in own]
        notes = [f"layout '{self.name}'", *notes, note]
        return fields_of(with_headings(grid_of(headings, columns, source=str(path), notes=notes)))


Columns = dict[str, dict[int, str]]
"""Of each body or marker the headings by the places of its columns, such as `{2: "qx", 6: "x[mm]"}`."""


def _parts(rows: list[list[str]]) -> tuple[Columns, Columns, list[list[str]], list[str]]:
    """Bodies, markers, the frames as far as they go on without an empty line, and decisions."""
    settings = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = UNITS[settings.get("Length Units", "Meters")]
    notes = [f"lengths in {unit}, as the file states"]
    start = next(i for i, row in enumerate(rows) if row[:1] == ["Frame"])
    found = {"Rigid Body": Columns(), "Marker": Columns()}
    types, names = next((row, rows[k]) for k, row in enumerate(rows[1:start], 2) if {*row} & {*found})
    parts = next(row for row in rows[1:start] if "Position" in row)
    headings = {("Position", a): f"{a.lower()}[{unit}]" for a in "XYZ"}
    if settings.get("Rotation Type", "Quaternion") == "Quaternion":
        headings |= {("Rotation", a): f"q{a.lower()}" for a in "WXYZ"}
    else:
        notes.append("orientations are left out: export them again with rotation type Quaternion")
    axes = rows[start]
    for i in range(2, len(axes)):
        if types[i] in found and (parts[i], axes[i]) in headings:
            found[types[i]].setdefault(names[i], {})[i] = headings[parts[i], axes[i]]
    end = next((k for k, row in enumerate(rows) if k > start and not row[0]), len(rows))
    frames = [(row + [""] * len(axes))[: len(axes)] for row in rows[start + 1 : end]]
    if not frames:
        raise StopIteration
    return found["Rigid Body"], found["Marker"], frames, notes


def chosen(names: list[str], naming: Naming | None, what: str, key: str) -> str:
    """The only body, topic or frame of a recording, or that which `--columns "key=NAME"` chooses."""
    pairs = naming.pairs if naming is not None else ()
    wanted = next((ours[0].name for theirs, ours in pairs if theirs.name == key), None)
    if wanted in names:
        return wanted
    if wanted is None and len(names) == 1:
        return names[0]
    why = f"'{wanted}' is none of them" if wanted is not None else "more than one"
    elsewhere = "choose with 'workbench identify --columns', or load a CSV here"
    how = remedy(f'choose with columns="{key}=NAME" (--columns)', page=elsewhere)
    raise OptionError(f"{what} {listed(names)}: {why}; {how}")
