"""Targets with deviations: `step_order, x_t …, x_dif …, joint_1 …`, in mm and deg.

The target is nominal forward kinematics, not a measurement. The measured position is target + deviation: the
words "difference between target and actual position" read the other way round, but the data say this sign (a
geometric fit has the higher likelihood, and the joints sag downwards under gravity).
"""

import re
from typing import final

from workbench.base.units import Quantity
from workbench.data.readers.fields import Fields
from workbench.data.readers.layouts.layout import AbstractTableLayout, Picker
from workbench.data.readers.table import Table

_TARGET = ["x_t", "y_t", "z_t"]
_DEVIATION = ["x_dif", "y_dif", "z_dif"]


@final
class TargetDeviation(AbstractTableLayout):
    """Point measurements as deviations from nominal targets."""

    name = "target-deviation"

    def matches(self, headings: list[str]) -> bool:
        return {*_TARGET, *_DEVIATION, "joint_1"} <= set(headings)

    def read(self, table: Table) -> Fields:
        joints = sorted(
            (h for h in table.headings if re.fullmatch(r"joint_\d+", h)), key=lambda h: int(h[6:])
        )
        pick = Picker(table, [*joints, *_TARGET, *_DEVIATION])
        pick.take([f"q{heading[6:]}" for heading in joints], joints, "deg", Quantity.ANGLE)
        pick.take("xyz", _DEVIATION, "mm", Quantity.LENGTH)
        for axis, target in zip("xyz", pick.numbers(_TARGET, "mm", Quantity.LENGTH), strict=True):
            pick.values[axis] = target + pick.values[axis]
        return pick.fields(
            f"layout '{self.name}': joints in deg, positions in mm",
            "the measured position is target + deviation (x_t + x_dif): the sign that the data support",
            "the targets are nominal forward kinematics, not measurements",
        )
