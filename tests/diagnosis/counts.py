"""Judged diagnoses counted by kind of case."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Share:
    """How the diagnoses of one kind came out; counts of cases unless said otherwise.

    Args:
        cases: All of them.
        right: Names right, nothing else named; of what has no name, nothing false and the error halved.
        in_class: Likewise where a named class of look-alikes counts.
        missed: A true effect was not named.
        false: How many effects were named that are not there.
        failed: No diagnosis.
        good: Saved model within half of the noise.
        error: Median error of the saved model per standard deviation of the noise.
        seconds: Median time of a diagnosis.
    """

    cases: int
    right: int
    in_class: int
    missed: int
    false: int
    failed: int
    good: int
    error: float
    seconds: float


def wilson(part: int, whole: int, z: float = 1.96) -> tuple[float, float]:
    """Bounds of a share that was counted, 95 % by default.

    Source: Wilson (1927), as in Brown, Cai and DasGupta (2001), eq. (4).
    """
    if not whole:
        return 0.0, 1.0
    share, wide = part / whole, z * z / whole
    middle = (share + wide / 2) / (1 + wide)
    half = z * np.sqrt(share * (1 - share) / whole + wide / (4 * whole)) / (1 + wide)
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def by_kind(judged):
    """Lists of judged diagnoses per kind, in order of appearance."""
    out = defaultdict(list)
    for one in judged:
        out[one.kind].append(one)
    return out


def share(ones):
    """How some diagnoses came out."""
    seconds = [one.seconds for one in ones if not one.failed] or [np.nan]
    errors = [one.error for one in ones if np.isfinite(one.error)] or [np.nan]
    return Share(
        cases=len(ones),
        right=sum(one.right for one in ones),
        in_class=sum(one.right_or_class for one in ones),
        missed=sum(bool(one.missed) for one in ones),
        false=sum(len(one.extra) for one in ones),
        failed=sum(one.failed for one in ones),
        good=sum(bool(one.good) for one in ones),
        error=float(np.median(errors)),
        seconds=float(np.median(seconds)),
    )
