"""Rows that one arm can explain, where it can't explain those of a file: a diagnosis is made of them instead.

Where joints and places are of different times, joints are taken at the times of the places. Where constants
of the arm changed at a row, only later ones are left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.drivers.driver import SPEED, Follower, Shape
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.diagnosis.remaining_error import CHANGED, LAGGED
from workbench.diagnosis.result import Diagnosis
from workbench.identification.rows.course import course

MAX_MENDS = 4
"""Maximum number of times that rows are mended: speeds, and so a delay, are known better each time."""
BEFORE, AT_END = "before the arm changed", "at an end of the motion, where its speed isn't known"
LATER = "the arm changed among the rows, and the saved one is that of the later rows alone"


@dataclass(frozen=True, eq=False)
class MendedRows:
    """All rows of a file with what is done to them.

    Args:
        mended: They, with joints as at the times of the places.
        left_out: Which of them are left out, by number, and why.
        delay: By how long the places were later than the joints [s, or rows].
        followed: What the error of all rows followed.
    """

    rows: Dataset
    mended: Dataset
    left_out: Mapping[int, str] = field(default_factory=dict)
    delay: float = 0.0
    followed: tuple[FollowedDriver, ...] = ()

    def again(self, found: Diagnosis) -> "MendedRows | None":
        """The same, mended by what their diagnosis found; None if nothing is to be mended."""
        rows, lags = self.rows, [f for f in found.followed if f.delay and f.confidence is Confidence.CERTAIN]
        if lags and (self.delay or found.harm == LAGGED):
            came = course(rows, rows, delay=(delay := self.delay + lags[0].delay))
            ends = rows.row[(came.begins | np.roll(came.begins, -1))[came.place]].tolist()
            part = replace(lags[0].parts[-1], phrase=f"{SPEED}, {came.text(delay)}")
            lag = replace((self.followed or lags)[0], parts=(part,))
            return MendedRows(rows, replace(rows, q=came.q), dict.fromkeys(ends, AT_END), delay, (lag,))
        steps = tuple(f for f in found.followed if changes([f]))
        if found.harm != CHANGED or not steps:
            return None
        clock, later = clock_of(rows)[0], [part.since for part in changes(steps)]
        early = rows.row[clock < max(clock[np.isin(rows.row, mine)].min() for mine in later)]
        left_out = {**self.left_out, **dict.fromkeys(early.tolist(), BEFORE)}
        return replace(self, left_out=left_out, followed=(*self.followed, *steps))

    def told(self, found: Diagnosis) -> Diagnosis:
        """The diagnosis that is made of them, with what the error of all rows followed."""
        done = {True: "the rows before were left out", False: "joints were taken at the times of the places"}
        told = [f"The error {f.text}; {done[bool(changes([f]))]}." for f in self.followed]
        told += [found.message, *[f"Warning: {LATER}."] * bool(changes(self.followed) and not found.harm)]
        harm = found.harm or (LATER if changes(self.followed) else None)
        return replace(found, followed=self.followed + found.followed, harm=harm, message=" ".join(told))


def changes(followed: Sequence[FollowedDriver]) -> list[Follower]:
    """Sudden changes of the arm itself, at least probable ones, that an error follows."""
    sure = [p for f in followed if f.confidence is not Confidence.OPEN for p in f.parts]
    return [p for p in sure if p.shape is Shape.STEP and p.part not in ("frame", "tool")]
