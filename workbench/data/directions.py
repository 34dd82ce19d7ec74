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
    session = np.zeros(len(data), int)
    if data.session is not None:
        session = np.unique(data.session, return_inverse=True)[1]
    order = np.lexsort((data.time, session))
    moved = np.diff(data.q[order], axis=0, prepend=data.q[order][:1])
    moved[np.flatnonzero(np.diff(session[order], prepend=-1))] = 0.0
    sign = np.where(np.abs(moved) > MIN_JOINT_MOTION, np.sign(moved), 0.0)
    out = np.empty_like(sign)
    out[order] = _continued(sign, session[order])
    note = (
        "direction of motion: from the time order of the rows, assuming direct motion from each to the next"
    )
    return replace(data, direction=out, notes=(*data.notes, note))


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


def _continued(sign: np.ndarray, session: np.ndarray) -> np.ndarray:
    """Signs in which a joint that stands still keeps its last one, within a session."""
    place = np.where(sign != 0.0, np.arange(len(sign))[:, None], -1)
    first = np.concatenate([[0], np.flatnonzero(np.diff(session)) + 1])
    start = first[np.searchsorted(first, np.arange(len(sign)), side="right") - 1]
    last = np.maximum.accumulate(place, axis=0)
    rows = np.where(last >= start[:, None], last, 0)
    return np.where(last >= start[:, None], np.take_along_axis(sign, rows, axis=0), 0.0)
