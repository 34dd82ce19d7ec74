"""Measurements joined by time with joints of a robot's log, in another table or beside them, in standstills.

Joints and measurements are averaged over each standstill: a stretch of the log of `WINDOW` or longer
in which no joint ranges beyond `STILL`. Nothing is interpolated while the arm moves. Samples within `MARGIN`
of a standstill's ends are left out, as clocks differ by their latencies and arms settle. Two files with
clocks of their own are brought together by when both moved (`clock_offset`).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import final

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import DataError
from workbench.base.hand_eye import nearest_rotation
from workbench.base.wording import plural
from workbench.data.readers.assemble import excluded_rows, joint_columns
from workbench.data.readers.column_meanings import NO_DAY
from workbench.data.readers.columns_option import GROUPS
from workbench.data.readers.fields import Fields
from workbench.data.readers.joint_tables import AbstractJoin, by_row, merged
from workbench.data.readers.orientation import read_orientation

WINDOW, MARGIN, GAP = 0.4, 0.1, 1.0
"""Shortest standstill, what is left out at its ends, and the silence that ends it [s]."""
STILL, STILL_POINT = np.deg2rad(0.03), 5e-4
"""Range of a joint [rad or m], and of a measured point [m], in a standstill."""
MIN_MOVING, MIN_STANDING, MIN_STRAIGHT = 0.1, 0.25, 0.5
"""Shares of samples in motion and in standstills of a log, and how straight its moves are by steps."""
DENSE = 0.25
"""Samples that are this near to each other show when something moved [s]."""
STEP = 0.02
MIN_CORRELATION, MIN_CORRELATION_RATIO = 0.6, 1.1
"""Minimum correlation of both motions, and how much better it is than at any other offset."""
CHECK = "check that both are of the same run, and that time[s] is of one clock"
ORIENTATION_KEYS = {key for keys in GROUPS.values() for key in keys} - {"x", "y", "z"}

Times = Float[np.ndarray, " samples"]


@final
class ByTime(AbstractJoin):
    """Where both tables have times, or measurements ran on and the joints are one row a pose."""

    name = "by-time"

    def applies(self, measured: Fields, joints: Fields) -> bool:
        if "time" not in measured.values:
            return False
        if measured is joints:
            is_whole = {"q1", "x"} <= set(measured.values) and _dense(measured.values["time"])
            return is_whole and _is_log(_sorted(measured))
        return "time" in joints.values or (measured.rows > joints.rows and _dense(measured.values["time"]))

    def join(self, measured: Fields, joints: Fields) -> Fields:
        if "time" in joints.values:
            return join_by_time(measured, joints, one_clock=measured is joints)
        time, points = measured.values["time"], _points(measured)
        seen = np.flatnonzero(np.isfinite(points).all(1))
        runs = [seen[a : b + 1] for a, b in still(time[seen], points[seen], STILL_POINT)] if len(seen) else []
        parts = [r[(time[r] >= time[r[0]] + MARGIN) & (time[r] <= time[r[-1]] - MARGIN)] for r in runs]
        return by_row(_averaged(measured, parts, "the measured point"), joints)


def join_by_time(measured: Fields, joints: Fields, *, one_clock: bool = False) -> Fields:
    """Measurements and joints averaged over each standstill of the arm.

    Args:
        measured: With a column `time`.
        joints: Samples of the joints with `time`.
        one_clock: Whether both times are of one clock; else an offset is looked for.
    """
    measured, joints = _sorted(_turned(_dated(measured, joints))), _sorted(joints)
    q = joint_columns(joints, None)
    whole = np.isfinite(q).all(1)
    joints, q = joints.take(np.flatnonzero(whole)), q[whole]
    time, log = measured.values["time"], joints.values["time"]
    offset, notes = (0.0, ()) if one_clock else clock_offset(time, _points(measured), log, q)
    standstills = still(log, q, STILL)
    parts, of_joints = list[np.ndarray](), list[np.ndarray]()
    for first, last in standstills:
        low, high = log[first] - offset + MARGIN, log[last] - offset - MARGIN
        rows = np.arange(np.searchsorted(time, low), np.searchsorted(time, high, side="right"))
        own = _by_point(measured, rows[np.isfinite(_points(measured)[rows]).any(1)])
        inside = np.flatnonzero((log >= log[first] + MARGIN) & (log <= log[last] - MARGIN))
        parts, of_joints = parts + own, of_joints + [inside] * len(own)
    if not parts:
        stood = f"{plural(len(standstills), 'standstill')} of {WINDOW} s or longer in {joints.source}"
        text = f"nothing was measured while the arm stood still ({stood}); {CHECK}"
        raise DataError(f"{measured.source}: {text}")
    found = _averaged(measured, parts, "the tool")
    rest = {key: own for key, own in joints.values.items() if key not in measured.values}
    along = {key: np.array([_middle(own[rows]) for rows in of_joints]) for key, own in rest.items()}
    used = sum(len(part) for part in parts)
    note = (
        f"{plural(len(parts), 'row')} from {plural(len(standstills), 'standstill')} of the arm of {WINDOW} "
        f"s or longer: joints and measurements are averages over each; {measured.rows - used} of "
        f"{measured.rows} samples are not used (in motion, within {MARGIN} s of it, unseen) or excluded"
    )
    return merged(found, along, joints, (*notes, note))


def _dated(measured: Fields, joints: Fields) -> Fields:
    """Measurements whose time counts from the first date of the joints, where both have dates."""
    first, second = measured.began, joints.began
    kinds = [(began.tzinfo is None, began.year == NO_DAY) for began in (first, second) if began]
    if first and second and kinds[0] == kinds[1]:
        time = measured.values["time"] + (first - second).total_seconds()
        return replace(measured, values={**measured.values, "time": time}, began=second)
    if first is second is None or (_dense(measured.values["time"]) and _dense(joints.values["time"])):
        return measured
    how = "give both dates of one time zone, or both seconds of one clock"
    raise DataError(f"{measured.source} and {joints.source} count time differently: {how}")


def still(time: Times, values: Float[np.ndarray, "samples n"], maximum: float) -> list[tuple[int, int]]:
    """First and last sample of every stretch of at least `WINDOW` in which no value ranges beyond a limit."""
    found: list[tuple[int, int]] = []
    first, low, high = 0, values[0], values[0]
    for k in range(1, len(time) + 1):
        if k < len(time) and time[k] - time[k - 1] < GAP:
            lower, higher = np.minimum(low, values[k]), np.maximum(high, values[k])
            if np.max(higher - lower) <= maximum:
                low, high = lower, higher
                continue
        if time[k - 1] - time[first] >= WINDOW + 2.0 * MARGIN:
            begin, end = found[-1] if found else (0, 0)
            is_near = bool(found) and time[first] - time[end] < WINDOW
            moved = values[begin : end + 1].mean(0) - values[first:k].mean(0)
            if is_near and np.abs(moved).max() <= maximum:
                found[-1] = begin, k - 1
            else:
                found.append((first, k - 1))
        if k < len(time):
            first, low, high = k, values[k], values[k]
    return found


def clock_offset(
    time: Times, points: Float[np.ndarray, "samples m"], log: Times, q: Float[np.ndarray, "logged n"]
) -> tuple[float, tuple[str, ...]]:
    """What is added to times of the measurements to have those of the log, and a sentence if that is not 0.

    Where both are dense, the moments in which something moved are correlated over all offsets, and how fast
    it moved, as a program may move in one rhythm. Where the measurements are few, both clocks are taken for
    one.
    """
    if not (_dense(time) and _dense(log)):
        return 0.0, ()
    from scipy.signal import correlate

    measured = _motion(time, points)
    alike, as_fast = map(correlate, _motion(log, q), measured)
    score = np.maximum(alike, 0.0) * np.maximum(as_fast, 0.0)
    offsets = STEP * (np.arange(len(score)) - (measured.shape[1] - 1)) + log[0] - time[0]
    best = int(np.argmax(score))
    others = score[np.abs(offsets - offsets[best]) > 1.0]
    now = score[np.abs(offsets) <= 3.0 * STEP]
    if len(now) and now.max() > 0.9 * score[best] and alike[best] > MIN_CORRELATION:
        return 0.0, ()
    if alike[best] < MIN_CORRELATION or (len(others) and score[best] < MIN_CORRELATION_RATIO * others.max()):
        how = "no offset" if alike[best] < MIN_CORRELATION else "more than one offset"
        text = f"{how} of their clocks makes measurements and joints move at the same times"
        check = "check that they are of the same run, or give both the same clock in time[s]"
        raise DataError(f"{text}: {check}", column="time")
    text = f"the clocks differ by {offsets[best]:+.2f} s, found from the times at which joints and tool moved"
    return float(offsets[best]), (text,)


def _motion(time: Times, values: Float[np.ndarray, "samples n"]) -> Float[np.ndarray, "2 steps"]:
    """Whether something moved, step by step, and how fast, each less its mean and of norm 1."""
    from scipy.ndimage import uniform_filter1d

    seen = np.isfinite(values).all(1)
    time, values = time[seen], values[seen]
    steps = np.arange(time[0], time[-1] + 2.0 * STEP, STEP)  # two at least
    even = np.stack([np.interp(steps, time, column) for column in values.T], 1)
    speed = np.linalg.norm(np.diff(uniform_filter1d(even, 5, axis=0, mode="constant"), axis=0), axis=1)
    both = np.stack([speed > 0.05 * np.quantile(speed, 0.95), speed])
    both -= both.mean(1, keepdims=True)
    return both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), 1e-12)


def _dense(time: Times) -> bool:
    return len(time) > 100 and float(np.median(np.diff(np.sort(time)))) < DENSE


def _is_log(log: Fields) -> bool:
    """Whether all samples of joints and measurements were taken in standstills or on continuous moves.

    A pose that is neither, of few samples or alone, would be lost; a scan hardly stands: its moves count.
    """
    time, q = log.values["time"], joint_columns(log, None)
    moving = np.ones(log.rows, bool)
    for first, last in (found := still(time, q, STILL)):
        moving[first : last + 1] = False
    silent = np.diff(time, prepend=-np.inf) >= GAP
    steps = np.where(silent[:, None], 0.0, np.diff(q, axis=0, prepend=q[:1]))
    lengths = np.linalg.norm(steps, axis=1)
    straight = (steps * np.roll(steps, -1, 0)).sum(1) - MIN_STRAIGHT * lengths * np.roll(lengths, -1)
    runs = np.flatnonzero(silent | np.diff(moving, prepend=moving[:1]))
    moved = np.add.reduceat(straight, runs)[moving[runs]] > STILL**2
    return len(found) > 1 and MIN_MOVING < moving.mean() < 1.0 - MIN_STANDING and bool(moved.all())


def _points(measured: Fields) -> np.ndarray:
    keys = [k for k in measured.values if k in ("x", "y", "z") or (k[0] == "m" and k[1:-1].isdigit())]
    if not keys:
        raise DataError(f"{measured.source}: there are no positions to join with joints: x[m], y[m], z[m]")
    return np.stack([measured.values[key] for key in keys], 1)


def _by_point(measured: Fields, rows: Int[np.ndarray, " n"]) -> list[np.ndarray]:
    """The rows of one standstill, those of each named point by themselves."""
    if not len(rows) or "point" not in measured.values:
        return [rows] if len(rows) else []
    names = measured.values["point"][rows]
    return [rows[names == name] for name in dict.fromkeys(names.tolist())]


def _averaged(measured: Fields, parts: Sequence[np.ndarray], what: str) -> Fields:
    """One row a standstill, of samples that aren't excluded if there are any; labels are of the first."""
    measured, excluded = _turned(measured), excluded_rows(measured)
    parts = [rows if excluded[rows].all() else rows[~excluded[rows]] for rows in parts]
    values = {k: np.array([_middle(own[rows]) for rows in parts]) for k, own in measured.values.items()}
    turns = measured.rotation
    rotation = None if turns is None else np.stack([_middle(turns[rows]) for rows in parts])
    lines = tuple(measured.lines[int(rows[0])] for rows in parts)
    ranges = [np.ptp(_points(measured.take(rows)), axis=0) for rows in parts]
    restless = [k for k, size in enumerate(ranges) if np.nanmax(size, initial=0.0) > 4.0 * STILL_POINT]
    if len(restless) > len(parts) // 2:
        where = f"by more than {4e3 * STILL_POINT:g} mm in {len(restless)} of {len(parts)} standstills"
        raise DataError(f"{measured.source}: {what} moves {where}: {CHECK}")
    places = [f"{plural(len(restless), 'standstill')}, such as line {lines[k]}" for k in restless[:1]]
    notes = (*measured.notes, *(f"{what} moved in {place}" for place in places))
    return replace(measured, values=values, rotation=rotation, lines=lines, notes=notes)


def _turned(measured: Fields) -> Fields:
    """The same with rotation matrices in place of whatever columns an orientation has."""
    if measured.rotation is not None or not ORIENTATION_KEYS & set(measured.values):
        return measured
    rotation, notes = read_orientation(measured, usable=np.ones(measured.rows, bool))
    values = {k: v for k, v in measured.values.items() if k not in ORIENTATION_KEYS}
    return replace(measured, values=values, rotation=rotation, notes=measured.notes + notes)


def _middle(column: np.ndarray) -> np.ndarray | np.generic:
    """Mean of numbers that are there, and the rotation nearest to that of rotations; the first label."""
    if column.dtype.kind != "f":
        return column[0]
    seen = column[np.isfinite(column.reshape(len(column), -1)).all(1)]
    mean = seen.mean(0) if len(seen) else np.full(column.shape[1:], np.nan)
    return nearest_rotation(mean) if column.ndim > 1 and len(seen) else mean


def _sorted(fields: Fields) -> Fields:
    """Rows in the order of time; those without are left out."""
    time = fields.values["time"]
    order = np.argsort(time, kind="stable")
    return fields.take(order[np.isfinite(time[order])])
