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
        keys = [f"q{heading[6:]}" for heading in joints]
        values = dict(zip(keys, pick.numbers(joints, "deg", Quantity.ANGLE), strict=True))
        target = pick.numbers(_TARGET, "mm", Quantity.LENGTH)
        deviation = pick.numbers(_DEVIATION, "mm", Quantity.LENGTH)
        values |= {axis: t + d for axis, t, d in zip("xyz", target, deviation, strict=True)}
        notes = (
            f"layout '{self.name}': joints in deg, positions in mm",
            "the measured position is target + deviation (x_t + x_dif): the sign that the data support",
            "the targets are nominal forward kinematics, not measurements",
        )
        return Fields(
            source=table.source,
            lines=table.lines,
            values=values,
            headings=dict(zip(keys, joints, strict=True)) | dict(zip("xyz", _DEVIATION, strict=True)),
            units=dict.fromkeys(keys, "deg") | dict.fromkeys("xyz", "mm"),
            notes=pick.notes + notes,
        )
