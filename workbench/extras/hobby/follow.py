"""Leader against follower: offset, direction, scale and lag of each joint from one recording of both.

    follower(t) = sign · scale · leader(t − lag) + offset

by least squares, the lag by trial. Neighbouring frames err alike; the intervals take that into account by the
covariance of Newey and West after a first-order prediction.

Where the leader commands the follower (teleoperation), this is how the follower obeys: its offset is droop
under weight and play, whatever the zeros of the two arms are. Zeros show where both are moved by hand along
each other with torque off.

Source: Newey, West, A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent
covariance matrix, Econometrica 55(3), 1987; Andrews, Monahan, An improved heteroskedasticity and
autocorrelation consistent covariance matrix estimator, Econometrica 60(4), 1992.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
from jaxtyping import Float
from rich.console import RenderableType

from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError, FileError
from workbench.base.units import parse_heading
from workbench.base.wording import listed
from workbench.data.readers.fields import decimal_of, to_numbers
from workbench.data.readers.read import read_table
from workbench.extras.hobby.data_set import ACTION, STATE, MotorLog, read_data_set, root_of
from workbench.extras.hobby.layouts import COUNTS, TURN
from workbench.report.json import Json, document
from workbench.report.numbers import signed
from workbench.report.result_display import AbstractShown
from workbench.report.tables import headed, new_table

SCHEMA = "workbench.following/1"
SIDES = {"leader": ("leader", ACTION), "follower": ("follower", STATE)}
COLUMN = rf"({'|'.join(re.escape(name) for names in SIDES.values() for name in names)})[._ /-]+(.+)"
"""Heading of a motor's column in a table of both arms."""
TIMES = ("timestamp", "time", "t")
LAGS = (-0.3, 1.0)
"""Lags tried [s]."""
MOVED, FRAMES = 5.0, 100
"""Minimum range of a leader's joint [°] and number of frames."""
ALIKE = 0.7
"""Correlation below which a joint does not follow."""
MEMORY = 1.0
"""Time over which errors are alike [s]."""
NORMAL = 1.96
COMMANDED = (
    "the leader commanded the follower, so offsets are its sag and play, not the zeros: for these, record "
    "both arms moved by hand in parallel, or map each arm ('workbench hobby map')"
)


@final
@dataclass(frozen=True, kw_only=True)
class FollowedJoint:
    """How one joint follows; each value with half of its 95 % interval.

    Args:
        name: Of the motor.
        offset: The follower where the leader is at 0 [°].
        scale: Degrees of the follower for one of the leader; negative where it runs the other way.
        lag: How much later the follower is there [s].
        left: Root mean square of what is left [°].
    """

    name: str
    offset: tuple[float, float]
    scale: tuple[float, float]
    lag: tuple[float, float]
    left: float

    @property
    def is_off(self) -> bool:
        """Whether the offset is more than noise and a count."""
        return abs(self.offset[0]) > max(2.0 * self.offset[1], 360.0 / TURN)

    @property
    def is_scaled(self) -> bool:
        """Whether a degree of the leader is clearly another of the follower."""
        return abs(abs(self.scale[0]) - 1.0) > max(2.0 * self.scale[1], 0.01)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Following(AbstractShown):
    """How a follower's joints follow the leader's."""

    source: str
    joints: tuple[FollowedJoint, ...]
    commanded: bool
    notes: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        off = [
            f"{j.name} is {signed(j.offset[0], 2)}° ± {j.offset[1]:.2f} off" for j in self.joints if j.is_off
        ]
        off += [f"{j.name} runs in the opposite direction" for j in self.joints if j.scale[0] < 0.0]
        off += [f"{j.name} moves {abs(j.scale[0]):.3f} times as far" for j in self.joints if j.is_scaled]
        late = float(np.median([j.lag[0] for j in self.joints]))
        found = "; ".join(off) or "offsets, directions and scales agree"
        return f"{found}; the follower is {signed(1e3 * late, 0)} ms late"

    def summary(self) -> RenderableType:
        table = new_table(
            "Follower against leader", "joint", "offset [°]", "±", "scale", "±", "lag [ms]", "±", "left [°]"
        )
        for j in self.joints:
            numbers = (*(signed(v, 2) for v in j.offset), *(signed(v, 4) for v in j.scale))
            lag = (signed(1e3 * v, 0) for v in j.lag)
            table.add_row(j.name, *numbers, *lag, f"{j.left:.2f}")
        return headed(self.sentence, table, notes=self.notes)

    def json(self) -> Json:
        """The result as plain data: degrees and seconds, as the recording has them."""
        keys = ("offset", "scale", "lag")
        joints = [
            {"name": j.name, "left_deg": j.left}
            | {key: {"value": getattr(j, key)[0], "half_width": getattr(j, key)[1]} for key in keys}
            for j in self.joints
        ]
        message = {"message": self.sentence, "commanded": self.commanded, "notes": list(self.notes)}
        return document(SCHEMA, source=self.source, **message, joints=joints)


@checked_arguments()
def compare_leader(recording: Path) -> Following:
    """Compare a follower with its leader.

    Args:
        recording: A LeRobot data set, or a table with a time and columns `leader.NAME`, `follower.NAME`
            (degrees, or `[counts]`).

    Raises:
        FileError: no such recording.
        DataError: too few frames, a joint that did not move, or that follows no joint of its own.
    """
    log = read_data_set(recording) if root_of(recording) is not None else _table(recording)
    if log.action is None:
        raise DataError(f"{log.source}: only one arm is recorded; leader and follower are needed ({ACTION})")
    if len(log.time) < FRAMES:
        raise DataError(
            f"{log.source}: {len(log.time)} frames; record ten seconds or more with every joint moved"
        )
    leader, follower = (values[:, log.joints] for values in (log.action, log.state))
    names = [log.names[k] for k in log.joints]
    leader, follower, notes = _unwrapped(leader, follower, log, names)
    if still := [n for n, column in zip(names, leader.T, strict=True) if np.ptp(column) < MOVED]:
        raise DataError(
            f"{log.source}: the leader's {', '.join(still)} moved too little; move every joint by 20° or more"
        )
    joints = [_joint(n, log, x, y) for n, x, y in zip(names, leader.T, follower.T, strict=True)]
    _check_pairs(log, names, leader, follower, float(np.median([j.lag[0] for j in joints])))
    if commanded := root_of(recording) is not None:
        notes = (*notes, COMMANDED)
    return Following(source=log.source, joints=tuple(joints), commanded=commanded, notes=notes)


def _table(path: Path) -> MotorLog:
    """Columns `leader.NAME` and `follower.NAME` of a table, in degrees."""
    table = read_table(path, columns=None, sheet=None)
    found: dict[str, dict[str, tuple[int, float]]] = {side: {} for side in SIDES}
    headings = [parse_heading(heading) for heading in table.headings]
    times = [k for k, heading in enumerate(headings) if heading.name.lower() in TIMES]
    for k, (name, unit) in enumerate(headings):
        if m := re.fullmatch(COLUMN, name, re.IGNORECASE):
            step = 360.0 / TURN if (unit or "").lower() in COUNTS else 180.0 / np.pi if unit == "rad" else 1.0
            side = next(side for side, names in SIDES.items() if m[1].lower() in names)
            found[side][m[2].removesuffix(".pos")] = (k, step)
    names = [name for name in found["leader"] if name in found["follower"]]
    if not names or not times:
        raise FileError(
            "has no leader and follower: give a LeRobot data set, or time[s] and columns leader.NAME and "
            f"follower.NAME; found {listed(table.headings)}",
            path=str(path),
        )
    used = [found[side][name][0] for side in found for name in names]
    decimal = decimal_of(table, [times[0], *used])
    time = to_numbers(table, times[0], decimal)
    sides = [
        np.stack([step * to_numbers(table, k, decimal) for k, step in (own[n] for n in names)], 1)
        for own in found.values()
    ]
    whole = np.isfinite(np.column_stack([time, *sides])).all(1)
    order = np.flatnonzero(whole)[np.argsort(time[whole], kind="stable")]
    return MotorLog(
        source=str(path),
        names=tuple(names),
        time=time[order],
        episode=np.zeros(len(order), int),
        state=sides[1][order],
        action=sides[0][order],
    )


def _unwrapped(leader: np.ndarray, follower: np.ndarray, log: MotorLog, names: list[str]):
    """Both without jumps of a whole turn, and a note about it."""
    out, passed = [], set()
    for values in (leader, follower):
        parts = [np.unwrap(values[log.episode == e], axis=0, period=360.0) for e in np.unique(log.episode)]
        smooth = np.concatenate(parts)
        passed |= {names[k] for k in np.flatnonzero(np.abs(smooth - values).max(0) > 1.0)}
        out.append(smooth)
    turns = 360.0 * np.round((np.median(out[1], axis=0) - np.median(out[0], axis=0)) / 360.0)
    notes = (
        (f"{', '.join(sorted(passed))} passes a whole turn of counts, which was unwrapped",) if passed else ()
    )
    return out[0], out[1] - turns, notes


def _shifted(log: MotorLog, x: np.ndarray, lag: float) -> np.ndarray:
    """The leader `lag` earlier; NaN before an episode begins and after it ends."""
    out = np.full(len(x), np.nan)
    for episode in np.unique(log.episode):
        rows = log.episode == episode
        out[rows] = np.interp(log.time[rows] - lag, log.time[rows], x[rows], left=np.nan, right=np.nan)
    return out


def _joint(name: str, log: MotorLog, x: np.ndarray, y: np.ndarray) -> FollowedJoint:
    """Least squares in offset and scale at each lag, then in all three."""
    step = float(np.median(np.diff(log.time)[np.diff(log.episode) == 0]))
    lags = np.arange(LAGS[0], LAGS[1], 0.5 * step)
    left = [_line(_shifted(log, x, lag), y)[2] for lag in lags]
    k = int(np.argmin(left))
    lag = float(lags[k])
    if 0 < k < len(lags) - 1:
        a, b, c = left[k - 1 : k + 2]
        lag += 0.25 * step * (a - c) / max(a - 2.0 * b + c, 1e-300)
    moved = _shifted(log, x, lag)
    scale, offset, _ = _line(moved, y)
    speed = (_shifted(log, x, lag - 0.5 * step) - _shifted(log, x, lag + 0.5 * step)) / step
    whole = np.isfinite(moved) & np.isfinite(speed)
    columns = np.stack([moved, np.ones(len(x)), -scale * speed], 1)[whole]
    error = (y - scale * moved - offset)[whole]
    half = NORMAL * np.sqrt(np.diag(_newey_west(columns, error, int(MEMORY / step))))
    return FollowedJoint(
        name=name,
        offset=(float(offset), float(half[1])),
        scale=(float(scale), float(half[0])),
        lag=(lag, float(half[2])),
        left=float(np.sqrt((error**2).mean())),
    )


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Slope, value at 0 and mean square error of the line through points."""
    seen = np.isfinite(x)
    slope, at = np.polyfit(x[seen], y[seen], 1).tolist()
    return slope, at, float(((y - slope * x - at)[seen] ** 2).mean())


def _newey_west(
    columns: Float[np.ndarray, "rows p"], error: Float[np.ndarray, " rows"], memory: int
) -> Float[np.ndarray, "p p"]:
    """Covariance of a least-squares fit whose neighbouring errors are alike."""
    each = columns * error[:, None]
    size = len(each)
    spread = np.sqrt((each**2).mean(0)) + 1e-300
    before, after = each[:-1] / spread, each[1:] / spread
    along = np.linalg.solve(before.T @ before, before.T @ after).T
    each = after - before @ along.T
    middle = each.T @ each
    for k in range(1, min(memory, len(each) - 1) + 1):
        both = each[k:].T @ each[:-k]
        middle += (1.0 - k / (memory + 1.0)) * (both + both.T)
    back = spread[:, None] * np.linalg.inv(np.eye(len(spread)) - along)
    middle = back @ middle @ back.T * size / (size - len(spread))
    inverse = np.linalg.pinv(columns.T @ columns)
    return inverse @ middle @ inverse


def _check_pairs(
    log: MotorLog, names: list[str], leader: np.ndarray, follower: np.ndarray, lag: float
) -> None:
    """Refuse joints that follow another one, or none."""
    moved = np.stack([_shifted(log, x, lag) for x in leader.T], 1)
    seen = np.isfinite(moved).all(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        table = np.corrcoef(moved[seen].T, follower[seen].T)[: len(names), len(names) :]
    alike = np.abs(np.nan_to_num(table))
    for k, name in enumerate(names):
        if alike[k, k] < ALIKE:
            other = int(np.argmax(alike[:, k]))
            what = "does not follow the leader's; was its torque off?"
            if alike[other, k] > ALIKE:
                what = f"follows the leader's {names[other]}: exchanged"
            raise DataError(f"{log.source}: the follower's {name} {what}")
