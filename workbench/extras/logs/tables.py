"""Data whose headings don't say what they mean: a controller's log, and three public sets of measurements."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from workbench.base.errors import FileError
from workbench.base.units import Quantity, parse_heading, to_si
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields, fields_of, to_numbers
from workbench.data.readers.file_kind import read_bytes
from workbench.data.readers.headings import UR_JOINTS, normalised
from workbench.data.readers.layouts import AbstractFileLayout, AbstractTableLayout, named
from workbench.data.readers.table import Grid, Table, with_headings
from workbench.data.readers.text import read_text


@final
class Rtde(AbstractTableLayout):
    """A log of Universal Robots' RTDE, as `--joints` takes it: joints over time, in s and rad.

    The controller's own TCP pose is its forward kinematics, not a measurement, and is left out.
    """

    name = "rtde"
    joints = tuple(f"actual_q_{i}" for i in range(6))

    def matches(self, headings: list[str]) -> bool:
        names = {parse_heading(heading).name.lower() for heading in headings}
        return {"timestamp", *self.joints} <= set(headings) and not {"x", "y", "z"} <= names

    def read(self, table: Table) -> Fields:
        names = {heading: f"q{k}[rad]" for k, heading in enumerate(self.joints, 1)} | {"timestamp": "time[s]"}
        return named(table, names, f"layout '{self.name}': measured joints over time; TCP poses are left out")


@final
class TargetDeviation(AbstractTableLayout):
    """Targets with deviations: `step_order, x_t …, x_dif …, joint_1 …`, in mm and deg.

    The target is nominal forward kinematics, not a measurement. The measured position is target + deviation:
    the words "difference between target and actual position" read the other way round, but the data say this
    sign (a geometric fit has the higher likelihood, and the joints sag downwards under gravity).
    """

    name = "target-deviation"
    targets, deviations = ("x_t", "y_t", "z_t"), ("x_dif", "y_dif", "z_dif")

    def matches(self, headings: list[str]) -> bool:
        return {*self.targets, *self.deviations, "joint_1"} <= set(headings)

    def read(self, table: Table) -> Fields:
        joints = [heading for heading in table.headings if re.fullmatch(r"joint_\d+", heading)]
        names = {heading: f"q{heading[6:]}[deg]" for heading in joints}
        names |= {heading: f"{axis}[mm]" for axis, heading in zip("xyz", self.deviations, strict=True)}
        fields = named(
            table,
            names,
            f"layout '{self.name}': joints in deg, positions in mm",
            "the measured position is target + deviation (x_t + x_dif): the sign that the data support",
            "the targets are nominal forward kinematics, not measurements",
        )
        targets = (to_si(to_numbers(table, heading), "mm", Quantity.LENGTH) for heading in self.targets)
        places = {axis: t + fields.values[axis] for axis, t in zip("xyz", targets, strict=True)}
        return replace(fields, values={**fields.values, **places})


@final
class IpaGrid(AbstractTableLayout):
    """Grid series with a 6D probe: `Timestamp; Goal x …; shoulder_pan_joint …; measurement_x …`.

    Goals are in m and rad, measurements in mm and deg, R = Rx(rx) Ry(ry) Rz(rz) (intrinsic X-Y-Z). Goals are
    never taken as measurements; equal goal positions make a `group`.
    """

    name = "ipa-grid"
    joints = tuple(f"{name}_joint" for name in UR_JOINTS)
    goals = ("Goal x", "Goal y", "Goal z")
    position = tuple(f"measurement_{axis}" for axis in "xyz")
    angles = tuple(f"measurement_r{axis}" for axis in "xyz")

    def matches(self, headings: list[str]) -> bool:
        return {"Timestamp", *self.goals, *self.joints, *self.position, *self.angles} <= set(headings)

    def read(self, table: Table) -> Fields:
        names = {heading: f"q{k}[rad]" for k, heading in enumerate(self.joints, 1)}
        names |= {heading: f"{axis}[mm]" for axis, heading in zip("xyz", self.position, strict=True)}
        if "measurement_temperature" in table.headings:
            names["measurement_temperature"] = "temperature[degC]"
        at = table.headings.index("Timestamp")
        dates = tuple(re.sub(r"(\d{8})(\d{6})", r"\1T\2", stamp) for stamp in table.columns[at])  # ISO 8601
        columns = (*table.columns[:at], dates, *table.columns[at + 1 :])
        fields = named(
            replace(table, columns=columns),
            names | {"Timestamp": "time"},
            f"layout '{self.name}': joints in rad, measured position in mm, measured angles in deg with "
            "R = Rx(rx) Ry(ry) Rz(rz)",
            "the goal columns are commanded, not measured; equal goal positions make a group",
            "time counts from the first row" if len({*dates}) > 1 else "all times are equal and left out",
        )
        goals = (table.columns[table.headings.index(heading)] for heading in self.goals)
        places = list(zip(*goals, strict=True))
        numbers = {goal: str(k) for k, goal in enumerate(dict.fromkeys(places))}
        turned = np.stack([to_numbers(table, heading) for heading in self.angles], axis=-1)
        turns = {f"orientation {axis}": heading for axis, heading in zip("xyz", self.angles, strict=True)}
        return replace(
            fields,
            values={**fields.values, "group": np.array([numbers[goal] for goal in places], str)},
            rotation=Rotation.from_euler("XYZ", turned, degrees=True).as_matrix(),
            headings={**fields.headings, **turns},
            units={**fields.units, **dict.fromkeys(turns, "deg")},
        )


@final
class Polar(AbstractTableLayout):
    """Polar coordinates of a tracker or total station beside joints: `azimuth, zenith, distance`, `Hz, V, D`.

    x = D sin V cos Hz, y = D sin V sin Hz, z = D cos V, with V from the zenith. A circle Hz in gon is a total
    station's and counts clockwise; another one that does mirrors these places, which rows of an arm tell.
    """

    name = "polar"
    words = (
        re.compile(r"azimuth?|az|hz|hori[sz]ontal(_angle)?"),
        re.compile(r"zenith?|v|za|vertical(_angle)?|(?P<level>elevation|elev|el|altitude)(_angle)?"),
        re.compile(r"(slope_|slant_)?dist(ance|anz)?|(schräg)?strecke|d|s|sd|range|r"),
    )

    def matches(self, headings: list[str]) -> bool:
        return all(len(places) == 1 for places in self._places(headings))

    def _places(self, headings: Sequence[str]) -> list[list[int]]:
        names = [normalised(parse_heading(heading).name) for heading in headings]
        alone = not {"x", "y", "z"} & set(names)
        return [[k for k, name in enumerate(names) if alone and w.fullmatch(name)] for w in self.words]

    def read(self, table: Table) -> Fields:
        at = [k for (k,) in self._places(table.headings)]
        name, units = zip(*(parse_heading(table.headings[k]) for k in at), strict=True)
        for k in [k for k, unit in zip(at, units, strict=True) if unit is None]:
            raise table.error(f"the unit is missing: write '{table.headings[k]}[deg]', [gon], [mm] or [m]", k)
        kinds = (Quantity.ANGLE, Quantity.ANGLE, Quantity.LENGTH)
        each = zip(at, units, kinds, strict=True)
        turned, down, far = (to_si(to_numbers(table, k), u or "", kind) for k, u, kind in each)
        way = ""
        if units[0] in ("gon", "grad") and not normalised(name[0]).startswith("az"):
            turned, way = -turned, ", counted clockwise as by a total station"
        if (found := self.words[1].fullmatch(normalised(name[1]))) and found["level"]:
            down = np.pi / 2.0 - down
        places = far * np.array([np.sin(down) * np.cos(turned), np.sin(down) * np.sin(turned), np.cos(down)])
        columns, names = list(table.columns), list(table.names)
        for k, axis, values in zip(at, "xyz", places, strict=True):
            columns[k], names[k] = tuple("" if np.isnan(v) else repr(float(v)) for v in values), f"{axis}[m]"
        note = f"layout '{self.name}': {', '.join(name)} are polar coordinates{way}, read as x, y, z"
        notes = (*table.notes, note)
        return fields_of(replace(table, columns=tuple(columns), names=tuple(names), notes=notes))


SPACING = 0.05
"""Distance of the two sockets' centres [m]."""
_POSE = re.compile(r"hole_\d+_pose\.csv")


@final
class Mukca(AbstractFileLayout):
    """A ball put into two sockets 50 mm apart: a robot's folder with placements, one placement, or a file.

    `<placement>/hole_0.csv` and `hole_1.csv` hold joint angles only. Each placement of the sockets is a
    session with a frame of its own: socket 0 at its origin, socket 1 at (0.05, 0, 0) m. Where that frame lies
    in the robot's base is unknown, and its rotation about the line through both sockets can't be seen.
    """

    name = "mukca"

    def matches(self, path: Path, head: bytes) -> bool:
        return bool(_sockets(path) if path.is_dir() else _POSE.fullmatch(path.name))

    def read(self, path: Path, naming: Naming | None) -> Fields:
        if _POSE.fullmatch(path.name):
            why = "these poses are the controller's own forward kinematics, not measurements"
            raise FileError(f"{why}: read the folder with hole_0.csv and hole_1.csv", path=str(path))
        files = [path] if path.is_file() else _sockets(path)
        if not files:
            raise FileError("there are no hole_0.csv or hole_1.csv in this folder", path=str(path))
        rows, lines = list[list[str]](), list[int]()
        for file in files:
            grid, socket = read_text(read_bytes(file), file), int(file.name[5])
            width = len(rows[0]) - 5 if rows else len(grid.rows[0])
            if (odd := next((k for k, row in enumerate(grid.rows) if len(row) != width), None)) is not None:
                text = f"it has {len(grid.rows[odd])} joints, the rows before {width}"
                raise grid.error(f"{text}: correct it, and read one robot at a time", odd)
            place = [repr(SPACING * socket), "0", "0", file.parent.name, f"socket{socket}"]
            rows, lines = rows + [[*row, *place] for row in grid.rows], lines + grid.lines
        headings = [f"q{k}[rad]" for k in range(1, len(rows[0]) - 4)]
        headings += ["x[m]", "y[m]", "z[m]", "session", "point"]
        notes = (
            "layout 'mukca': joint angles in rad, one session per placement",
            f"positions are not measured: socket 0 is at (0, 0, 0), socket 1 at ({SPACING}, 0, 0) m in a "
            "frame that differs between sessions, so base frames must be free per session",
        )
        whole = Grid(source=str(path), rows=[headings, *rows], lines=[0, *lines], notes=notes)
        return fields_of(with_headings(whole))


def _sockets(path: Path) -> list[Path]:
    """Files of sockets in a folder, or in those right below it."""
    return sorted((*path.glob("hole_[01].csv"), *path.glob("*/hole_[01].csv")))
