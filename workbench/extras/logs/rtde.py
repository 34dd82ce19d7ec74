"""Logs of Universal Robots' RTDE: `timestamp actual_q_0 … actual_q_5`, in s and rad.

The controller's own TCP pose is its forward kinematics, not a measurement, and is left out.
"""

from typing import final

from workbench.base.units import Quantity
from workbench.data.readers.fields import Fields
from workbench.data.readers.layouts.layout import AbstractTableLayout, Picker
from workbench.data.readers.table import Table

_JOINTS = [f"actual_q_{i}" for i in range(6)]


@final
class Rtde(AbstractTableLayout):
    """Joints over time, as `--joints` takes them."""

    name = "rtde"

    def matches(self, headings: list[str]) -> bool:
        return {"timestamp", *_JOINTS} <= set(headings)

    def read(self, table: Table) -> Fields:
        pick = Picker(table, ["timestamp", *_JOINTS])
        pick.take([f"q{i}" for i in range(1, 7)], _JOINTS, "rad", Quantity.ANGLE)
        pick.take(["time"], ["timestamp"], "s", Quantity.TIME)
        return pick.fields(f"layout '{self.name}': measured joints over time; TCP poses are left out")
