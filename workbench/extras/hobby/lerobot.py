"""The motor calibration of LeRobot arms: joint offsets as shifted ranges.

    degrees = (raw − (range_min + range_max) / 2) · 360 / 4095

Zero is the middle of a motor's range. An offset of the joint moves the middle: the range is cut at one
end, never widened, so that no motor is sent where it was not led by hand; half a count (0.044°) is the finest
step. Homing offsets, which differ in sign between makes of motors,

    counts = encoder − homing_offset (Feetech),      counts = encoder + homing_offset (Dynamixel)

bring the zero to the middle of the turn, and the range moves along.

Source: lerobot, motors_bus.py (`_normalize`), feetech.py, dynamixel.py, and its calibration files.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from workbench.base.errors import MALFORMED, FileError, OptionError
from workbench.data.dataset import Dataset
from workbench.extras.hobby.layouts import COUNTED, TURN, ZERO

LEROBOT_TURN = 4095.0
"""Counts that LeRobot takes for a turn."""
MIDDLE, MAX_HOMING = 2047, 2047
"""Count that LeRobot makes the middle of a turn, and the largest homing offset of a Feetech motor."""
KEYS = ("id", "drive_mode", "homing_offset", "range_min", "range_max")


class Make(StrEnum):
    """Makes of motors, by which the homing offset has its sign."""

    FEETECH = "feetech"
    DYNAMIXEL = "dynamixel"


@dataclass(frozen=True)
class Motor:
    """What LeRobot knows of a motor.

    Args:
        name: Of the joint, such as `elbow_flex`.
        id: On the bus.
        drive_mode: 1 where positions in percent of the range count backwards.
        homing_offset: Counts between the encoder's zero and that of positions.
        range_min: Lowest position that the joint was led to [counts].
        range_max: Highest.
    """

    name: str
    id: int
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int

    def angles(self, counts: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Joint positions [rad] of positions in counts."""
        return (counts - 0.5 * (self.range_min + self.range_max)) * 2.0 * np.pi / LEROBOT_TURN

    def with_zero(self, angle: float, make: Make) -> "Motor":
        """The motor whose zero is where it read an angle [rad], in the middle of the turn."""
        twice = self.range_min + self.range_max + round(2.0 * angle * LEROBOT_TURN / (2.0 * np.pi))
        low, high = max(self.range_min, twice - self.range_max), min(self.range_max, twice - self.range_min)
        if high <= low:
            raise OptionError(f"'{self.name}' would keep no range, as its offset is {angle:.3f} rad")
        shift = twice // 2 - MIDDLE
        homing = self.homing_offset + (shift if make is Make.FEETECH else -shift)
        if make is Make.FEETECH:  # its register holds one turn
            homing = max((homing + 2048) % 4096 - 2048, -MAX_HOMING)
        return replace(self, homing_offset=homing, range_min=low - shift, range_max=high - shift)

    def counts(self, percent: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Positions in counts of positions in −100 … 100 % of the range, which drive_mode may turn round."""
        sign = -1.0 if self.drive_mode else 1.0
        return (0.5 * (sign * percent / 100.0 + 1.0)) * (self.range_max - self.range_min) + self.range_min


def read_motors(text: str, joints: int, *, path: str = "the LeRobot calibration") -> tuple[Motor, ...]:
    """Motors of the first joints of a LeRobot calibration."""
    try:
        table = json.loads(text)
        motors = [Motor(name, *(int(entry[key]) for key in KEYS)) for name, entry in table.items()]
    except MALFORMED:
        keys = ", ".join(KEYS)
        raise FileError(f"is not a LeRobot motor calibration: each motor has {keys}", path=path) from None
    if len(motors) < joints:
        raise FileError(f"has {len(motors)} motors, the arm {joints} joints", path=path)
    if wrong := next((m for m in motors if m.range_min >= m.range_max), None):
        raise FileError(f"the range of '{wrong.name}' is empty; calibrate it with LeRobot first", path=path)
    return tuple(motors[:joints])


def as_angles(data: Dataset, motors: tuple[Motor, ...] | None, *, percent: bool) -> Dataset:
    """Motors' angles from the middles of their ranges, as LeRobot has them in degrees.

    Args:
        data: Counts or degrees read as joints, or with `percent` parts of the range.
        motors: Their calibration; None: counts stay angles from 2048.
    """
    if motors is None:
        return data
    if percent and COUNTED in data.notes:
        raise OptionError(f"--percent: {data.source} has columns in counts; leave --percent out")
    q = data.q.copy()
    for k, motor in enumerate(motors[: q.shape[1]]):
        if COUNTED in data.notes:
            middle = 0.5 * (motor.range_min + motor.range_max)
            past = q[:, k] * TURN / (2.0 * np.pi) + ZERO - middle + TURN / 2
            turned = past % TURN - TURN / 2  # counts may pass 4095 and 0
            q[:, k] = motor.angles(turned + middle)
        elif percent:
            if np.abs(np.rad2deg(q[:, k])).max() > 100.5:
                raise OptionError(
                    f"--percent: '{motor.name}' goes beyond 100 %; its column holds degrees or counts"
                )
            q[:, k] = motor.angles(motor.counts(np.rad2deg(q[:, k])))
    return replace(data, q=q)


def with_zeros(text: str, zeros: Sequence[float], make: Make) -> str:
    """A calibration's text whose motors have 0° where they read these angles [rad]; NaN: as they were."""
    table = json.loads(text)
    for motor, zero in zip(read_motors(text, len(zeros)), zeros, strict=True):
        if np.isfinite(zero):
            moved = motor.with_zero(float(zero), make)
            table[motor.name] |= {key: getattr(moved, key) for key in KEYS}
    return json.dumps(table, indent=4) + "\n"
