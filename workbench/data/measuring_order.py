"""What orders rows as they were measured: times where every row has one, else their places in the file.

And in that order, sessions for rows after something happened, and the direction of every joint's last motion,
the driver of backlash.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import revised
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.data.dataset import Dataset

SAME_RUN_SHARE = 0.5
"""Part of the minimum time between rows of a file that rows of two files of one run are apart."""
MIN_JOINT_MOTION = 1e-6
"""Changes of a joint [rad or m] below this are no motion; the last direction holds on."""


def clock_of(data: Dataset) -> tuple[Float[np.ndarray, " rows"], bool]:
    """What orders rows, and whether that is time: not where sessions' times begin anew."""
    time, places = data.time, (np.asarray(data.row, float), False)
    if time is None or not np.isfinite(time).all() or not len(time) or np.ptp(time) <= 0.0:
        return places
    spans = sorted((t.min(), t.max()) for t in (time[data.in_session(s)] for s in data.sessions))
    return places if any(a[1] > b[0] for a, b in pairwise(spans)) else (np.asarray(time, float), True)


def beside(other: Dataset, data: Dataset) -> Dataset:
    """Rows of another file, which say whether they are of a later time than all that happened in the first.

    They are not if both are parts of one file, with other row numbers. Else they are, unless their times lie
    between those of the first file as if one run had been divided: an arm is in one place at a time, so that
    no two rows come much closer than those of each file do.
    """
    if other.source == data.source and not np.isin(other.row, data.row).any():
        return other
    times = [clock_of(rows) for rows in (data, other)]
    if not all(is_timed for _, is_timed in times):
        return revised(other, is_of_later=True)
    first, second = (np.sort(clock) for clock, _ in times)
    overlap = first[0] <= second[-1] and second[0] <= first[-1]
    nearest = np.diff(np.sort(np.concatenate([first, second]))).min()
    usual = min(np.diff(first).min(), np.diff(second).min())
    return revised(other, is_of_later=not (overlap and nearest > SAME_RUN_SHARE * usual))


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
