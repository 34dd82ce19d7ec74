"""Grid series of a robot with a 6D probe: commanded goals and measured poses in one table, in mixed units.

Goals are in m and rad, measurements in mm and deg; the measured orientation is R = Rx(rx) Ry(ry) Rz(rz)
(intrinsic X-Y-Z). Goals are never taken as measurements; equal goal positions make a `group`.
"""

from datetime import datetime
from typing import final

import numpy as np

from workbench.base.units import Quantity
from workbench.data.readers.fields import Fields
from workbench.data.readers.layouts.layout import AbstractTableLayout, Picker
from workbench.data.readers.orientation import intrinsic_xyz
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
        pick.take([f"q{i}" for i in range(1, 7)], _JOINTS, "rad", Quantity.ANGLE)
        pick.take("xyz", _POSITION, "mm", Quantity.LENGTH)
        pick.values["time"] = _seconds(table, pick.text("Timestamp"))
        if "measurement_temperature" in table.headings:
            pick.take(["temperature"], ["measurement_temperature"], "degC", Quantity.TEMPERATURE)
        pick.values["group"] = _numbered(list(zip(*(pick.text(goal) for goal in _GOAL), strict=True)))
        pick.note_unit(_TURNS, _ANGLES, "deg")
        pick.note_unit(["time"], ["Timestamp"], "YYYYMMDDhhmmss")
        return pick.fields(
            f"layout '{self.name}': joints in rad, measured position in mm, measured angles in deg with "
            "R = Rx(rx) Ry(ry) Rz(rz)",
            "the goal columns are commanded, not measured; equal goal positions make a group",
            "time counts from the first row",
            rotation=intrinsic_xyz(np.stack(pick.numbers(_ANGLES, "deg", Quantity.ANGLE), -1)),
        )


def _seconds(table: Table, stamps: tuple[str, ...]) -> np.ndarray:
    """Seconds from the first row of `YYYYMMDDhhmmss` stamps."""
    times = []
    for row, stamp in enumerate(stamps):
        try:
            if len(stamp) != 14 or not stamp.isdecimal():
                raise ValueError
            times.append(datetime.fromisoformat(f"{stamp[:8]}T{stamp[8:]}"))
        except ValueError:
            index = table.headings.index("Timestamp")
            raise table.error(f"'{stamp}' is not a time YYYYMMDDhhmmss", index, row) from None
    return np.array([(time - times[0]).total_seconds() for time in times])


def _numbered(goals: list[tuple[str, ...]]) -> np.ndarray:
    """Names '0', '1', … of equal goals, in order of appearance."""
    numbers: dict[tuple[str, ...], int] = {}
    return np.array([str(numbers.setdefault(goal, len(numbers))) for goal in goals], dtype=str)
