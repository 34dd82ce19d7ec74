"""Motor readings by their LeRobot calibration, and that calibration with the zeros of a map."""

import json
from dataclasses import replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.data.dataset import Dataset
from workbench.extras.hobby.layouts import COUNTED, TURN, ZERO
from workbench.extras.hobby.lerobot import Make, Motor
from workbench.extras.hobby.motor_map import MotorMap


def as_angles(data: Dataset, motors: tuple[Motor, ...] | None, *, percent: bool) -> Dataset:
    """Motors' angles from the middles of their ranges, as LeRobot has them in degrees.

    Args:
        data: Counts or degrees read as joints, or with `percent` parts of the range.
        motors: Their calibration; None: counts stay angles from 2048.
    """
    if motors is None:
        return data
    q = data.q.copy()
    for k, motor in enumerate(motors[: q.shape[1]]):
        if COUNTED in data.notes:
            middle = 0.5 * (motor.range_min + motor.range_max)
            past = q[:, k] * TURN / (2.0 * np.pi) + ZERO - middle + TURN / 2
            q[:, k] = motor.angles(past % TURN - TURN / 2 + middle)  # counts may pass 4095 and 0
        elif percent:
            if np.abs(np.rad2deg(q[:, k])).max() > 100.5:
                raise OptionError(
                    f"--percent: '{motor.name}' goes beyond 100 %; its column holds degrees or counts"
                )
            q[:, k] = motor.angles(motor.counts(np.rad2deg(q[:, k])))
    return replace(data, q=q)


def with_zeros(text: str, motors: tuple[Motor, ...], found: MotorMap, make: Make) -> str:
    """A calibration's text with homing offsets and ranges that put each known zero in the middle."""
    if found.exchanged:
        names = " and ".join(found.exchanged)
        raise OptionError(f"{names} are exchanged: exchange their ids with LeRobot first")
    table = json.loads(text)
    for motor, offset, sign in zip(motors, found.offsets, found.counting.signs, strict=True):
        if np.isfinite(offset):
            table[motor.name] |= motor.with_zero(-sign * float(offset), make).entry
    return json.dumps(table, indent=4) + "\n"
