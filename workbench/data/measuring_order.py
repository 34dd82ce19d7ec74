"""What orders rows as they were measured: times where every row has one, else their places in the file.

And sessions in that order, for rows after something happened.
"""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from workbench.arm.frame import revised
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset

SPLIT = re.compile(r"^before row \d+$| ?from row \d+′*$")
"""What `split_sessions` says in the name of a session."""
SAME_RUN_SHARE = 0.5
"""Part of the minimum time between rows of a file that rows of two files of one run are apart."""


def clock_of(data: Dataset) -> tuple[Float[np.ndarray, " rows"], bool]:
    """What orders rows, and whether that is time: not where sessions' times begin anew."""
    time = data.time
    if time is None or not np.isfinite(time).all() or not len(time) or np.ptp(time) <= 0.0:
        return np.asarray(data.row, float), False
    spans = sorted((t.min(), t.max()) for t in (time[data.in_session(s)] for s in data.sessions))
    if any(a[1] > b[0] for a, b in pairwise(spans)):
        return np.asarray(data.row, float), False
    return np.asarray(time, float), True


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


def split_sessions(data: Dataset, row: int) -> Dataset:
    """The same rows, those measured from one on in sessions of their own, with base and tool of their own.

    A session with rows on both sides keeps its name before and gets another one from there on; the others
    stay. Rows without sessions count as one.

    Args:
        row: Number in the file of the first row after something happened, as `Cause.row` has it.

    Raises:
        DataError: no row has that number, or no session has rows on both sides of it.
    """
    if row not in data.row:
        known = f"rows are {data.row.min()} to {data.row.max()}"
        raise DataError(f"{data.source}: there is no row {row}; {known}", row=row)
    clock, _ = clock_of(data)
    is_after = clock >= clock[data.row == row].min()
    whole = np.full(len(data), f"before row {row}") if data.session is None else data.session
    names = whole.astype(object)
    halves = [name for name in dict.fromkeys(names[is_after]) if (names[~is_after] == name).any()]
    if not halves:
        raise DataError(f"{data.source}: no session has rows both before row {row} and from it on", row=row)
    for name in halves:
        new = f"{SPLIT.sub('', name)} from row {row}".strip()
        while new in names:
            new += "′"
        names[is_after & (whole == name)] = new
    note = f"the rows from row {row} on, in the order of measurement, are separate sessions"
    return replace(data, session=names.astype(str), notes=(*data.notes, note))
