"""The result of a search for moved joints."""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.wording import joint_list
from workbench.data.dataset import Dataset
from workbench.identification.problem import Noise
from workbench.identification.report.results_json import errors_json, excluded_json, reading_json
from workbench.identification.result import BeforeAfter
from workbench.report.blocks import Block, ResultTable, Sentence, headed, lines
from workbench.report.json import Json, document
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown
from workbench.report.result_fields import JOINT, ResultField, ResultFields

SCHEMA = "workbench.rezero/1"
MOVED = "moved"
UNDETERMINED = "the rows determine no joint zero; measure more poses that differ in all joints"


def readable(unit: str) -> tuple[float, str]:
    """Factor and name of the unit in which people read a shift."""
    return (1e3, " mm") if unit == "m" else (float(np.rad2deg(1.0)), "°")


@dataclass(frozen=True)
class JointShift:
    """How far a joint's zero is from where the calibration had it.

    Args:
        joint: Counted from 0.
        name: The constant, such as `joint3.theta`.
        unit: `rad` or `m`.
        shift: Found minus calibrated.
        half: Half of the 95 % interval.
        determined: Whether the rows tell it.
        moved: Whether it moved by more than chance.
    """

    joint: int
    name: str
    unit: str
    shift: float
    std: float
    half: float
    determined: bool
    moved: bool = False

    @property
    def cells(self) -> list[str]:
        """Joint, shift, half of the interval and verdict, for people."""
        if not self.determined:
            return [str(self.joint + 1), "", "", "can't be determined"]
        factor, unit = readable(self.unit)
        digits = int(np.clip(1 - np.floor(np.log10(max(factor * self.half, 1e-9))), 1, 5))
        return [
            str(self.joint + 1),
            f"{signed(factor * self.shift, digits)}{unit}",
            f"±{factor * self.half:.{digits}f}{unit}",
            MOVED if self.moved else "not moved",
        ]

    @property
    def text(self) -> str:
        """`joint 3 by 0.42° ± 0.02°`."""
        joint, shift, half, _ = self.cells
        return f"joint {joint} by {shift} {half.replace('±', '± ')}"


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Rezero(AbstractShown):
    """Which joints moved since a calibration.

    Args:
        calibrated: The arm as it was.
        robot: The arm with the zeros that moved written, on the base and with the tool that were found; as it
            was where the result is refused.
        shifts: One for each joint that moves.
        doubts: What else the rows show, one sentence each; any of them refuses the result.
        ambiguous: What the rows can't distinguish, one sentence each.
        data: The rows that were fitted.
        error: On the rows, with the old zeros and with the new ones.
        noise: Standard deviations that weighed the rows.
        excluded: Rows that were kept out, with the reason.
    """

    calibrated: Robot
    robot: Robot
    shifts: tuple[JointShift, ...]
    doubts: tuple[str, ...]
    ambiguous: tuple[str, ...]
    error: BeforeAfter
    noise: Noise
    data: Dataset
    excluded: tuple[tuple[int, str], ...]
    notes: tuple[str, ...]

    @property
    def moved(self) -> tuple[JointShift, ...]:
        return tuple(sorted((s for s in self.shifts if s.moved), key=lambda s: -abs(s.shift) / s.std))

    @property
    def verdict(self) -> str:
        """`moved`, `unchanged` or `refused`."""
        return "refused" if self.doubts else MOVED if self.moved else "unchanged"

    @property
    def sentence(self) -> str:
        undetermined = [s.joint for s in self.shifts if not s.determined]
        lost = f"; {joint_list(undetermined)} can't be determined" if undetermined else ""
        determined = [s for s in self.shifts if s.determined]
        if not determined:
            return UNDETERMINED
        if self.doubts:
            return f"not the zeros{' alone' * bool(self.moved)}: {self.doubts[0]}"
        if self.moved:
            return f"moved: {'; '.join(s.text for s in self.moved)} (95 %){lost}"
        widest = max(determined, key=lambda s: s.half).cells[2].replace("±", "± ")
        still = f"{joint_list([s.joint for s in determined])} did not move" if lost else "no joint moved"
        return f"{still} by more than chance; zeros are known to {widest} or better (95 %){lost}"

    def blocks(self) -> list[Block]:
        title = "Shifts if zeros alone were off" if self.doubts else "Joint zeros since the calibration"
        rows = [[*s.cells[:3], "" if self.doubts and s.determined else s.cells[3]] for s in self.shifts]
        return headed(
            f"{self.calibrated.name}: {self.sentence}",
            ResultTable(title, ("joint", "moved by", "95 %", ""), rows),
            Sentence(repr(self.error), "on these rows"),
            *lines("warning", self.doubts),
            *lines("can't be distinguished", self.ambiguous),
            *lines("note", self.notes),
            *lines("excluded", (f"row {row} ({reason})" for row, reason in self.excluded)),
        )

    def json(self) -> Json:
        return document(
            SCHEMA,
            robot=self.calibrated.name,
            **reading_json(self.data, self.calibrated),
            verdict=self.verdict,
            message=self.sentence,
            joints=SHIFT.each(self.shifts),
            doubts=self.doubts,
            ambiguous=self.ambiguous,
            before=errors_json(self.error.before),
            after=errors_json(self.error.after),
            measurements={"used": len(self.data), "excluded": excluded_json(self.excluded, self.data)},
            noise=self.noise.json(),
            notes=self.notes,
        )


SHIFT = ResultFields(
    JOINT,
    *("name", "unit"),
    ResultField("shift", of=lambda s: s.shift if s.determined else None),
    ResultField("std", of=lambda s: s.std if s.determined else None),
    ResultField("interval", of=lambda s: (s.shift - s.half, s.shift + s.half) if s.determined else None),
    "moved",
)
"""Of a `JointShift`."""
