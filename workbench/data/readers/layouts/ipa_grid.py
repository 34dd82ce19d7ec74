"""Grid series of a robot with a 6D probe: commanded goals and measured poses in one table, in mixed units.

Goals are in m and rad, measurements in mm and deg; the measured orientation is R = Rx(rx) Ry(ry) Rz(rz)
(intrinsic X-Y-Z). Goals are never taken as measurements; equal goal positions make a `group`.
"""

from datetime import datetime
from typing import final

import numpy as np

from workbench.base import se3
from workbench.base.units import Quantity
from workbench.data.readers.fields import Fields
from workbench.data.readers.layouts.layout import AbstractTableLayout, Picker
from workbench.data.readers.table import Table

_JOINTS = [
    f"{name}_joint" for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
]
_GOAL = ["Goal x", "Goal y", "Goal z"]
_POSITION = ["measurement_x", "measurement_y", "measurement_z"]
_ANGLES = ["measurement_rx", "measurement_ry", "measurement_rz"]

_TURNS = ["orientation x", "orientation y", "orientation z"]


@final
class IpaGrid(AbstractTableLayout):
    """`Timestamp; Goal x …; shoulder_pan_joint …; measurement_x …; measurement_rx …`."""

    name = "ipa-grid"

    def matches(self, headings: list[str]) -> bool:
        return {"Timestamp", *_GOAL, *_JOINTS, *_POSITION, *_ANGLES} <= set(headings)

    def read(self, table: Table) -> Fields:
        pick = Picker(table, [*_JOINTS, *_POSITION, *_ANGLES])
        values = dict(
            zip([f"q{i}" for i in range(1, 7)], pick.numbers(_JOINTS, "rad", Quantity.ANGLE), strict=True)
        )
        values |= dict(zip("xyz", pick.numbers(_POSITION, "mm", Quantity.LENGTH), strict=True))
        rotation = _intrinsic_xyz(pick.numbers(_ANGLES, "deg", Quantity.ANGLE))
        values["time"] = _seconds(table, pick.text("Timestamp"))
        if "measurement_temperature" in table.headings:
            (values["temperature"],) = pick.numbers(["measurement_temperature"], "degC", Quantity.TEMPERATURE)
        values["group"] = _numbered(list(zip(*(pick.text(goal) for goal in _GOAL), strict=True)))
        headings = dict(zip([*values][:6], _JOINTS, strict=True)) | dict(zip("xyz", _POSITION, strict=True))
        headings |= dict(zip(_TURNS, _ANGLES, strict=True)) | {"time": "Timestamp"}
        headings["temperature"] = "measurement_temperature"
        units = dict.fromkeys(headings, "rad") | dict.fromkeys("xyz", "mm") | dict.fromkeys(_TURNS, "deg")
        units |= {"time": "YYYYMMDDhhmmss", "temperature": "degC"}
        notes = (
            f"layout '{self.name}': joints in rad, measured position in mm, measured angles in deg with "
            "R = Rx(rx) Ry(ry) Rz(rz)",
            "the goal columns are commanded, not measured; equal goal positions make a group",
            "time counts from the first row",
        )
        return Fields(
            source=table.source,
            lines=table.lines,
            values=values,
            headings=headings,
            units=units,
            rotation=rotation,
            notes=pick.notes + notes,
        )


def _intrinsic_xyz(angles: list[np.ndarray]) -> np.ndarray:
    """Rx(rx) Ry(ry) Rz(rz) of each row; NaN where an angle is missing."""
    rotation = np.full((len(angles[0]), 3, 3), np.nan)
    whole = ~np.isnan(angles).any(0)
    product = np.eye(3)
    for axis, angle in enumerate(angles):
        rpy = np.zeros((int(whole.sum()), 3))
        rpy[:, axis] = angle[whole]
        product = product @ se3.rpy_to_matrix(rpy)
    rotation[whole] = product
    return rotation


def _seconds(table: Table, stamps: tuple[str, ...]) -> np.ndarray:
    """Seconds from the first row of `YYYYMMDDhhmmss` stamps."""
    times = []
    for row, stamp in enumerate(stamps):
        try:
            times.append(datetime.strptime(stamp, "%Y%m%d%H%M%S"))
        except ValueError:
            index = table.headings.index("Timestamp")
            raise table.error(f"'{stamp}' is not a time YYYYMMDDhhmmss", index, row) from None
    return np.array([(time - times[0]).total_seconds() for time in times])


def _numbered(goals: list[tuple[str, ...]]) -> np.ndarray:
    """Names '0', '1', … of equal goals, in order of appearance."""
    numbers: dict[tuple[str, ...], int] = {}
    return np.array([str(numbers.setdefault(goal, len(numbers))) for goal in goals], dtype=str)
