"""Tables whose headings don't say what they mean: a controller's log, and two public sets of measurements."""

import re
from datetime import datetime
from typing import final

import numpy as np

from workbench.base.units import Quantity
from workbench.data.readers.fields import Fields
from workbench.data.readers.layouts.layout import AbstractTableLayout, Picker
from workbench.data.readers.orientation import intrinsic_xyz
from workbench.data.readers.table import Table

Q = [f"q{i}" for i in range(1, 7)]


@final
class Rtde(AbstractTableLayout):
    """A log of Universal Robots' RTDE, as `--joints` takes it: joints over time, in s and rad.

    The controller's own TCP pose is its forward kinematics, not a measurement, and is left out.
    """

    name = "rtde"
    joints = tuple(f"actual_q_{i}" for i in range(6))

    def matches(self, headings: list[str]) -> bool:
        return {"timestamp", *self.joints} <= set(headings) and not {"x", "y", "z"} <= set(headings)

    def read(self, table: Table) -> Fields:
        pick = Picker(table)
        pick.take(Q, [*self.joints], "rad", Quantity.ANGLE)
        pick.take(["time"], ["timestamp"], "s", Quantity.TIME)
        return pick.fields(f"layout '{self.name}': measured joints over time; TCP poses are left out")


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
        joints = sorted(
            (h for h in table.headings if re.fullmatch(r"joint_\d+", h)), key=lambda h: int(h[6:])
        )
        pick = Picker(table)
        pick.take([f"q{heading[6:]}" for heading in joints], joints, "deg", Quantity.ANGLE)
        pick.take("xyz", [*self.deviations], "mm", Quantity.LENGTH)
        for axis, target in zip("xyz", pick.numbers([*self.targets], "mm", Quantity.LENGTH), strict=True):
            pick.values[axis] = target + pick.values[axis]
        return pick.fields(
            f"layout '{self.name}': joints in deg, positions in mm",
            "the measured position is target + deviation (x_t + x_dif): the sign that the data support",
            "the targets are nominal forward kinematics, not measurements",
        )


@final
class IpaGrid(AbstractTableLayout):
    """Grid series with a 6D probe: `Timestamp; Goal x …; shoulder_pan_joint …; measurement_x …`.

    Goals are in m and rad, measurements in mm and deg, R = Rx(rx) Ry(ry) Rz(rz) (intrinsic X-Y-Z). Goals are
    never taken as measurements; equal goal positions make a `group`.
    """

    name = "ipa-grid"
    joints = tuple(
        f"{name}_joint"
        for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    )
    goals = ("Goal x", "Goal y", "Goal z")
    position = tuple(f"measurement_{axis}" for axis in "xyz")
    angles = tuple(f"measurement_r{axis}" for axis in "xyz")

    def matches(self, headings: list[str]) -> bool:
        return {"Timestamp", *self.goals, *self.joints, *self.position, *self.angles} <= set(headings)

    def read(self, table: Table) -> Fields:
        angles = [*self.angles]
        pick = Picker(table)
        pick.take(Q, [*self.joints], "rad", Quantity.ANGLE)
        pick.take("xyz", [*self.position], "mm", Quantity.LENGTH)
        pick.values["time"] = _seconds(table, pick.text("Timestamp"))
        if "measurement_temperature" in table.headings:
            pick.take(["temperature"], ["measurement_temperature"], "degC", Quantity.TEMPERATURE)
        goals = list(zip(*(pick.text(goal) for goal in self.goals), strict=True))
        numbers = {goal: str(k) for k, goal in enumerate(dict.fromkeys(goals))}
        pick.values["group"] = np.array([numbers[goal] for goal in goals], dtype=str)
        pick.note_unit([f"orientation {axis}" for axis in "xyz"], angles, "deg")
        pick.note_unit(["time"], ["Timestamp"], "YYYYMMDDhhmmss")
        return pick.fields(
            f"layout '{self.name}': joints in rad, measured position in mm, measured angles in deg with "
            "R = Rx(rx) Ry(ry) Rz(rz)",
            "the goal columns are commanded, not measured; equal goal positions make a group",
            "time counts from the first row",
            rotation=intrinsic_xyz(np.stack(pick.numbers(angles, "deg", Quantity.ANGLE), -1)),
        )


def _seconds(table: Table, stamps: tuple[str, ...]) -> np.ndarray:
    """Seconds from the first row of `YYYYMMDDhhmmss` stamps."""
    times = []
    for row, stamp in enumerate(stamps):
        try:
            times.append(datetime.fromisoformat(f"{stamp[:8]}T{stamp[8:]}" if len(stamp) == 14 else ""))
        except ValueError:
            index = table.headings.index("Timestamp")
            raise table.error(f"'{stamp}' is not a time YYYYMMDDhhmmss", index, row) from None
    return np.array([(time - times[0]).total_seconds() for time in times])
