"""Formats for joint offsets: a card of numbers to type in, and the motor calibration of LeRobot arms.

    LeRobot    degrees = (raw − (range_min + range_max) / 2) · 360 / 4095

There zero is the middle of a motor's range. An offset of the joint moves the middle: the range is cut at one
end, never widened, so that no motor is sent where it was not led by hand; half a count (0.044°) is the finest
step. Homing offsets, which differ in sign between makes of motors, stay as they are.

Source: lerobot, motors_bus.py (`_normalize`) and its calibration files.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import joint_elements
from workbench.arm.robot import JointKind, Robot
from workbench.base.errors import FileError, OptionError
from workbench.exports.export_format import AbstractForm, Job
from workbench.identification.controller_parameters import ControllerNumbers, Part, controller_numbers
from workbench.identification.report.how_to_apply import use_of
from workbench.report.result_display import as_text

TURN = 4095.0
"""Counts that LeRobot takes for a turn."""
KEYS = ("id", "drive_mode", "homing_offset", "range_min", "range_max")


@final
class OffsetsCard(AbstractForm):
    """Joint offsets, tool and base to type into a controller, and what each of these leaves."""

    name = "card"
    title = "card of joint offsets, tool and base to type, with what remains"
    ending = ".txt"
    takes_calibrated = True
    is_typed = True

    def write(self, job: Job) -> str:
        use = use_of(job.robot, job.require_nominal(self.name))
        return f"{job.robot.name}: numbers for a controller\n\n{as_text(use.summary())}"

    def read(self, text: str, job: Job) -> Robot:
        nominal = job.require_nominal(self.name)
        use = use_of(job.robot, nominal)
        return (use.advised or use.full).robot

    def notes(self, job: Job) -> Iterable[str]:
        use = use_of(job.robot, job.require_nominal(self.name))
        which = "all numbers, none of them advised" if use.advised is None else "the numbers advised"
        yield f"the figure is that of {which}, typed with all digits"

    def doubt(self, job: Job) -> str:
        use = use_of(job.robot, job.require_nominal(self.name))
        return use.advice if use.advised is None else ""


@dataclass(frozen=True)
class Motor:
    """What LeRobot knows of a motor.

    Args:
        name: Of the joint, such as `elbow_flex`.
        id: On the bus.
        drive_mode: 1 where positions in percent of the range count backwards.
        homing_offset: Counts between the encoder's zero and that of positions.
        range_min: Least position that the joint was led to [counts].
        range_max: Greatest.
    """

    name: str
    id: int
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int

    @property
    def limits(self) -> tuple[float, float]:
        """Least and greatest joint position [rad]."""
        half = np.pi * (self.range_max - self.range_min) / TURN
        return (-half, half)

    def angles(self, counts: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Joint positions [rad] of positions in counts."""
        return (counts - 0.5 * (self.range_min + self.range_max)) * 2.0 * np.pi / TURN

    def counts(self, percent: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """Positions in counts of positions in −100 … 100 % of the range, which drive_mode may turn round."""
        sign = -1.0 if self.drive_mode else 1.0
        return (0.5 * (sign * percent / 100.0 + 1.0)) * (self.range_max - self.range_min) + self.range_min


def read_motors(text: str, joints: int, *, path: str = "the LeRobot calibration") -> tuple[Motor, ...]:
    """Motors of the first joints of a LeRobot calibration."""
    try:
        table = json.loads(text)
        motors = [Motor(name, *(int(entry[key]) for key in KEYS)) for name, entry in table.items()]
    except (ValueError, KeyError, TypeError, AttributeError):
        keys = ", ".join(KEYS)
        raise FileError(f"is no motor calibration of LeRobot: each motor has {keys}", path=path) from None
    if len(motors) < joints:
        raise FileError(f"has {len(motors)} motors, the arm {joints} joints", path=path)
    if wrong := next((m for m in motors if m.range_min >= m.range_max), None):
        raise FileError(f"the range of '{wrong.name}' is empty; calibrate it with LeRobot first", path=path)
    return tuple(motors[:joints])


@final
class MotorCalibration(AbstractForm):
    """LeRobot's file with the middle of every range where the joint's zero is."""

    name = "lerobot"
    title = "motor calibration of LeRobot (JSON), for joint positions in degrees"
    ending = ".json"
    takes_calibrated = True

    def write(self, job: Job) -> str:
        table: Mapping[str, Any] = json.loads(self._source(job))
        offsets = self._offsets(job)
        for motor, offset in zip(self._motors(job), offsets, strict=True):
            halves = round(2.0 * offset * TURN / (2.0 * np.pi))
            key = "range_max" if halves > 0 else "range_min"
            table[motor.name][key] = getattr(motor, key) - halves
            if table[motor.name]["range_max"] <= table[motor.name]["range_min"]:
                raise OptionError(f"'{motor.name}' would keep no range, as its offset is {offset:.3f} rad")
        return json.dumps(table, indent=4) + "\n"

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
        return replace(nominal.with_values(values), joints=joints, base=found.base, tool=found.tool)

    def notes(self, job: Job) -> Iterable[str]:
        yield "joint positions must be read and sent in degrees (use_degrees): percent scale with the range"
        cut = np.rad2deg(np.abs(self._offsets(job)).max())
        yield f"ranges are cut at one end by up to {2.0 * cut:.2f}°, never widened"

    def doubt(self, job: Job) -> str:
        found = self._found(job)
        return f"don't use this file: {found.losses[0]}" if found.losses else ""

    def _source(self, job: Job) -> str:
        if job.source is None:
            raise OptionError("--for lerobot needs --source FILE, the arm's motor calibration as it is")
        return job.source

    def _motors(self, job: Job) -> tuple[Motor, ...]:
        nominal = job.require_nominal(self.name)
        if any(j.kind is not JointKind.REVOLUTE for j in nominal.moving):
            raise OptionError("--for lerobot is for joints that turn")
        return read_motors(self._source(job), nominal.dof)

    def _offsets(self, job: Job) -> Float[np.ndarray, " n"]:
        return self._found(job).offsets

    def _found(self, job: Job) -> ControllerNumbers:
        return controller_numbers(job.robot, job.require_nominal(self.name), parts=(Part.OFFSETS,))
