"""Direction of every joint's last motion, from the order of the rows in time; the driver of backlash."""

from dataclasses import replace

import numpy as np

from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.data.dataset import Dataset

MIN_JOINT_MOTION = 1e-6
"""Changes of a joint [rad or m] below this are no motion; the last direction holds on."""


def with_directions(data: Dataset) -> Dataset:
    """The rows with directions, where the file has none but says in which order it was measured.

    The arm is taken to have come straight from the row before, which holds for one continuous run; the
    first row of a session has no direction.
    """
    if data.direction is not None or data.time is None or not np.isfinite(data.time).all() or len(data) < 2:
        return data
    direction = np.zeros_like(data.q)
    for session in data.sessions:
        rows = np.flatnonzero(data.in_session(session))
        rows = rows[np.argsort(data.time[rows], kind="stable")]
        moved = np.diff(data.q[rows], axis=0, prepend=data.q[rows[:1]])
        has_moved = np.abs(moved) > MIN_JOINT_MOTION
        last = np.maximum.accumulate(np.where(has_moved, np.arange(len(rows))[:, None], 0), axis=0)
        direction[rows] = np.take_along_axis(np.where(has_moved, np.sign(moved), 0.0), last, axis=0)
    note = "direction of motion: from the time order of the rows, assuming direct motion between them"
    return replace(data, direction=direction, notes=(*data.notes, note))


def with_drivers(robot: Robot, data: Dataset) -> Dataset:
    """The rows with directions of motion, from their order in time, where an effect of the robot needs them.

    Rows that have them, or no times, are as they were; an effect that still misses them says so.

    Raises:
        DataError: the arm is too soft to hold its load in a row.
    """
    if any("direction" in effect.needs for effect in robot.effects):
        data = with_directions(data)
    shift_of(robot, Motion.of(data.take(data.included)))
    return data
