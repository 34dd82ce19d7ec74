"""Rows that one arm can explain, where it can't explain those of a file: a diagnosis is made of them instead.

Where joints and places are of different times, joints are taken at the times of the places. Where constants
of the arm changed at a row, only later ones are left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.cause_search import CauseSearch
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.drivers.driver import SPEED, Follower, Shape
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.diagnosis.remaining_error import CHANGED, LAGGED
from workbench.diagnosis.result import Diagnosis
from workbench.identification.rows.course import course

MAX_MENDS = 4
"""Maximum number of times that rows are mended: speeds, and so a delay, are known better each time."""
TAKEN = "joints were taken at the times of the places"
LEFT_OUT, BEFORE = "the rows before were left out", "before the arm changed"
AT_END = "at an end of the motion, where its speed isn't known"
LATER = "the arm changed among the rows, and the saved one is that of the later rows alone"


@dataclass(frozen=True, eq=False)
class MendedRows:
    """Rows with what was done to them.

    Args:
        whole: All rows of the file …
        rows: … and they as mended.
        left_out: Which of them are left out, by number, and why.
        delay: By how long the places were later than the joints [s, or rows].
        followed: What the error of all rows followed.
    """

    whole: Dataset
    rows: Dataset
    left_out: Mapping[int, str] = field(default_factory=dict)
    delay: float = 0.0
    followed: tuple[FollowedDriver, ...] = ()

    def again(self, search: CauseSearch, found: Diagnosis) -> "MendedRows | None":
        """They, mended by what their own diagnosis found; None if nothing is to be mended."""
        lags = [f for f in found.followed if f.shape is Shape.LAG and f.confidence is Confidence.CERTAIN]
        if search.drivers is not None and lags and (self.delay or found.harm == LAGGED):
            delay, came = self.delay + search.drivers.delay, course(self.whole, self.whole)
            bend = course(replace(self.whole, q=came.speed), self.whole)
            q = self.whole.q + delay * (came.speed + 0.5 * delay * bend.speed)
            ends = (came.begins | np.roll(came.begins, -1))[came.place]
            part = replace(lags[0].parts[-1], phrase=f"{SPEED}, {came.text(delay)}")
            return MendedRows(
                self.whole,
                replace(self.whole, q=q),
                dict.fromkeys(self.whole.row[ends].tolist(), AT_END),
                delay,
                (replace((self.followed or lags)[0], parts=(part,)),),
            )
        steps = tuple(f for f in found.followed if changes([f]))
        if found.harm != CHANGED or not steps:
            return None
        clock, later = clock_of(self.rows)[0], [part.since for part in changes(steps)]
        begin = max(clock[np.isin(self.rows.row, rows)].min() for rows in later)
        early = dict.fromkeys(self.rows.row[clock < begin].tolist(), BEFORE)
        return replace(self, left_out={**self.left_out, **early}, followed=(*self.followed, *steps))

    def told(self, found: Diagnosis) -> Diagnosis:
        """The diagnosis that is made of them, with what those of the file follow."""
        sentences = [f"The error {f.text}; {LEFT_OUT if changes([f]) else TAKEN}." for f in self.followed]
        sentences.append(found.message)
        harm = found.harm or (LATER if changes(self.followed) else None)
        sentences += [f"Warning: {harm}."] * (harm != found.harm)
        followed = (*self.followed, *found.followed)
        return replace(found, followed=followed, harm=harm, message=" ".join(sentences))


def changes(followed: Sequence[FollowedDriver]) -> list[Follower]:
    """Sudden changes of the arm itself, at least probable ones, that an error follows."""
    sure = [p for f in followed if f.confidence is not Confidence.OPEN for p in f.parts]
    return [p for p in sure if p.shape is Shape.STEP and p.part not in ("frame", "tool")]
