"""Judged diagnoses counted by kind of case."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

NOTHING = "nothing"


@dataclass(frozen=True)
class Share:
    """How the diagnoses of one kind came out; counts of cases unless said otherwise.

    Args:
        cases: All of them.
        right: Names right, nothing else named; of what has no name, nothing false and the error halved.
        in_class: Likewise where a named class of look-alikes counts.
        by_arm: Share that is right on each arm.
        missed: A true effect was not named.
        extra: An effect was named that is not there.
        false: How many such effects.
        named: Something was named.
        failed: No diagnosis.
        rows: All misplaced rows found, at most one other accused.
        good: Saved model within half of the noise.
        halved: Saved model within half of the geometry's error, or good.
        error: Median error of the saved model per standard deviation of the noise.
        seconds: Median time of a diagnosis, and the time that one in twenty takes longer than.
    """

    cases: int
    right: int
    in_class: int
    by_arm: dict[str, float]
    missed: int
    extra: int
    false: int
    named: int
    failed: int
    rows: int
    good: int
    halved: int
    error: float
    seconds: tuple[float, float]


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


def shares(judged):
    """Per kind: how its diagnoses came out."""
    return {kind: share(ones) for kind, ones in by_kind(judged).items()}


def share(ones):
    """How some diagnoses came out."""
    arms = {one.arm for one in ones}
    seconds = [one.seconds for one in ones if not one.failed] or [np.nan]
    errors = [one.error for one in ones if np.isfinite(one.error)] or [np.nan]
    return Share(
        cases=len(ones),
        right=sum(one.right for one in ones),
        in_class=sum(one.right_or_class for one in ones),
        by_arm={a: float(np.mean([one.right for one in ones if one.arm == a])) for a in sorted(arms)},
        missed=sum(bool(one.missed) for one in ones),
        extra=sum(bool(one.extra) for one in ones),
        false=sum(len(one.extra) for one in ones),
        named=sum(bool(one.found or one.extra) for one in ones),
        failed=sum(one.failed for one in ones),
        rows=sum(one.rows_right for one in ones),
        good=sum(bool(one.good) for one in ones),
        halved=sum(bool(one.halved) for one in ones),
        error=float(np.median(errors)),
        seconds=(float(np.median(seconds)), float(np.quantile(seconds, 0.95))),
    )


def confusion(judged):
    """Per kind and name: in how many cases it was named with a joint that is to blame, and with another."""
    out = {}
    for kind, ones in by_kind(judged).items():
        counts = defaultdict(lambda: [0, 0])
        for one in ones:
            blamed = {n.joints for n in (*one.truth, *one.found) if n in one.truth or n not in one.extra}
            for name in {f.name for f in one.found} or {NOTHING}:
                joints = {f.joints for f in one.found if f.name == name}
                counts[name][0 if joints <= blamed else 1] += 1
        out[kind] = {name: tuple(pair) for name, pair in counts.items()}
    return out
