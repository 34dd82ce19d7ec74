"""The motor calibration of LeRobot arms: joint offsets as shifted ranges.

    degrees = (raw − (range_min + range_max) / 2) · 360 / 4095

Zero is the middle of a motor's range. An offset of the joint moves the middle: the range is cut at one
end, never widened, so that no motor is sent where it was not led by hand; half a count (0.044°) is the finest
step. Homing offsets, which differ in sign between makes of motors, stay as they are unless the make is given:

    counts = encoder − homing_offset (Feetech),      counts = encoder + homing_offset (Dynamixel)

then they bring the zero to the middle of the turn, and the range moves along.

Source: lerobot, motors_bus.py (`_normalize`), feetech.py, dynamixel.py, and its calibration files.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import joint_elements
from workbench.arm.robot import JointKind, Robot
from workbench.base.errors import MALFORMED, FileError, OptionError
from workbench.data.dataset import Dataset
from workbench.exports.export_format import AbstractForm, Job
from workbench.extras.hobby.layouts import COUNTED, TURN, ZERO
from workbench.identification.controller_parameters import (
    ControllerNumbers,
    ControllerPart,
    controller_numbers,
)

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

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest joint position [rad]."""
        half = np.pi * (self.range_max - self.range_min) / LEROBOT_TURN
        return (-half, half)

    def angles(self, counts: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Joint positions [rad] of positions in counts."""
        return (counts - 0.5 * (self.range_min + self.range_max)) * 2.0 * np.pi / LEROBOT_TURN

    def with_zero(self, angle: float, make: Make | None = None) -> "Motor":
        """The motor whose zero is where it read an angle [rad]."""
        twice = self.range_min + self.range_max + round(2.0 * angle * LEROBOT_TURN / (2.0 * np.pi))
        low, high = max(self.range_min, twice - self.range_max), min(self.range_max, twice - self.range_min)
        if high <= low:
            raise OptionError(f"'{self.name}' would keep no range, as its offset is {angle:.3f} rad")
        if make is None:
            return replace(self, range_min=low, range_max=high)
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


def with_zeros(text: str, zeros: Sequence[float], make: Make | None = None) -> str:
    """A calibration's text whose motors have 0° where they read these angles [rad]; NaN: as they were."""
    table = json.loads(text)
    for motor, zero in zip(read_motors(text, len(zeros)), zeros, strict=True):
        if np.isfinite(zero):
            moved = motor.with_zero(float(zero), make)
            table[motor.name] |= {key: getattr(moved, key) for key in KEYS}
    return json.dumps(table, indent=4) + "\n"


@final
class MotorCalibration(AbstractForm):
    """LeRobot's file with the middle of every range where the joint's zero is."""

    name = "lerobot"
    title = "motor calibration of LeRobot (JSON), for joint positions in degrees"
    ending = ".json"
    takes_calibrated = True

    def write(self, job: Job) -> str:
        self._motors(job)
        return with_zeros(self._source(job), (-self._found(job).offsets).tolist())

    def read(self, text: str, job: Job) -> Robot:
        nominal = job.require_nominal(self.name)
        old, new = self._motors(job), read_motors(text, nominal.dof)
        moved = [
            float(b.angles(np.zeros(1))[0] - a.angles(np.zeros(1))[0]) for a, b in zip(old, new, strict=True)
        ]
        names = [nominal.chain.elements[i].name for i in joint_elements(nominal)]
        values = {n: float(v) + m for n, v, m in zip(names, nominal.values(tuple(names)), moved, strict=True)}
        limits = dict(zip([j.name for j in nominal.moving], (m.limits for m in new), strict=True))
        joints = tuple(replace(j, limits=limits.get(j.name, j.limits)) for j in nominal.joints)
        found = self._found(job)
        return replace(nominal.with_values(values), joints=joints, mounting=found.robot.mounting)

    def notes(self, job: Job) -> Iterable[str]:
        yield "joint positions must be read and sent in degrees (use_degrees): percent scale with the range"
        cut = np.rad2deg(np.abs(self._found(job).offsets).max())
        yield f"ranges are cut at one end by up to {2.0 * cut:.2f}°, never widened"

    def doubt(self, job: Job) -> str:
        found = self._found(job)
        return f"don't use this file: {found.losses[0]}" if found.losses else ""

    def _source(self, job: Job) -> str:
        if job.source is None:
            raise OptionError("--for lerobot needs --into FILE, the arm's motor calibration as it is")
        return job.source

    def _motors(self, job: Job) -> tuple[Motor, ...]:
        nominal = job.require_nominal(self.name)
        if any(j.kind is not JointKind.REVOLUTE for j in nominal.moving):
            raise OptionError("--for lerobot is for revolute joints")
        return read_motors(self._source(job), nominal.dof)

    def _found(self, job: Job) -> ControllerNumbers:
        return controller_numbers(job.robot, job.require_nominal(self.name), parts=(ControllerPart.OFFSETS,))
