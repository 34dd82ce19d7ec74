"""What a diagnosis of one virtual arm is worth: what it claimed, set apart and left, against the truth.

Right is a diagnosis that names every true effect with its joint (a harmonic with its order, a coupling with
both joints, backlash with its cause), and nothing else. Of many compliant joints those that matter must be
named and the others may be. A claim that leaves several open names none of them; where the truth is among
them the diagnosis is right in a named class, which is counted apart. An effect without a name asks for no
claim: right is who claims nothing false and halves the error of the geometry alone.

Errors are those of noise-free rows that nobody fitted: root mean square of the position's errors over rows
and axes, per standard deviation of the noise per axis. The saved model is good if its error is at most
`HALF`.
"""

import time
from dataclasses import dataclass

import numpy as np
from cases import ANY, CASES, Case, Named
from claims import claims

from workbench import Motion, tool_poses
from workbench.base.errors import DataError

HALF = 0.5
"""Of the noise that a good model may be off; of geometry's error that may be left of a law without a name."""


@dataclass(frozen=True)
class Judged:
    """One diagnosis beside the truth.

    Args:
        kind: Kind of case.
        arm: Which arm.
        seed: Its seed.
        truth: What should be named.
        found: What was named, one entry a joint (and order).
        missed: True effects that were not named.
        extra: Named effects that are not there, and leaders of classes that hold no truth.
        left_open: True effects that a class of look-alikes holds, and no claim names.
        claims: What each says, its confidence, the probability that it states, and whether it is true.
        nameless: Whether what is hidden has no name.
        seen: Whether the rows can show what is hidden, whatever is told of them.
        verdict: As the diagnosis says it; the error's sentence if it gave none.
        failed: Whether it gave none.
        misseated: How many rows are off.
        overlooked: How many of them were not set apart.
        accused: How many good rows were set apart.
        before: Error of the geometry alone, per standard deviation of the noise; NaN if none is told.
        error: Of the saved model; NaN if it gives no poses.
        seconds: Of the processor.
    """

    kind: str
    arm: str
    seed: int
    truth: tuple[Named, ...]
    found: tuple[Named, ...] = ()
    missed: tuple[Named, ...] = ()
    extra: tuple[Named, ...] = ()
    left_open: tuple[Named, ...] = ()
    claims: tuple[tuple[str, str, float, bool], ...] = ()
    nameless: bool = False
    seen: bool = True
    verdict: str = ""
    failed: bool = False
    misseated: int = 0
    overlooked: int = 0
    accused: int = 0
    before: float = float("nan")
    error: float = float("nan")
    seconds: float = float("nan")

    @property
    def odds(self):
        """Per claim with odds: the probability that it states, and whether it is true."""
        return [(stated, true) for *_, stated, true in self.claims if np.isfinite(stated)]

    def claimed(self, confidence, true):
        """Whether anything true, or false, is claimed with this confidence."""
        return any((how, holds) == (confidence, true) for _, how, _, holds in self.claims)

    @property
    def right(self):
        """Whether the names are right, or nothing is falsely named and the error is halved."""
        return self.clean and not self.missed and (self.halved or not self.nameless)

    @property
    def right_or_class(self):
        """Likewise, where classes of look-alikes that hold the truth count as naming it."""
        return self.right or (self.clean and not self.nameless and set(self.missed) <= set(self.left_open))

    @property
    def clean(self):
        """Whether nothing is falsely named."""
        return not (self.failed or self.extra)

    @property
    def halved(self):
        """Whether the saved model leaves half of the geometry's error, or is good."""
        return self.good or self.error <= HALF * self.before

    @property
    def rows_right(self):
        """Whether all rows that are off were set apart, and at most one other."""
        return not self.failed and self.overlooked == 0 and self.accused <= 1

    @property
    def good(self):
        """Whether the saved model is good."""
        return self.error <= HALF


def judge(case: Case, diagnose, *, is_true=None, **options) -> Judged:
    """Diagnose one arm and compare; `is_true` of result, claim and cause where names don't decide."""
    start = time.process_time()
    facts = {"kind": case.kind, "arm": case.arm, "seed": case.seed, "truth": case.truth, "seen": case.seen}
    facts["nameless"] = CASES[case.kind].nameless
    try:
        result = diagnose(case.robot, case.data, **options)
    except Exception as error:  # one that breaks is counted, and the others are still judged
        result = f"{type(error).__name__}: {error}"
        return Judged(**facts, missed=case.truth, verdict=result, failed=True, misseated=len(case.misseated))
    seconds = time.process_time() - start
    geometry = getattr(result, "before_fit", None)
    claims_of = claims(result)
    found = tuple(n for claim in claims_of if claim.decided for n in claim.names)
    stated = judged_claims(result, is_true or (lambda _, claim, __: not false_names(case, claim)))
    maybe = [n for c in claims_of if not c.decided for n in (*c.names, *c.rivals)]
    off, outliers = set(case.misseated), {int(r) for r in result.outliers}
    return Judged(
        **facts,
        found=found,
        missed=tuple(t for t in case.truth if t not in found),
        extra=tuple(
            n
            for claim, (*_, true) in zip(claims_of, stated, strict=True)
            if not true
            for n in false_names(case, claim)
        ),
        left_open=tuple(t for t in case.truth if t not in found and any(_same(n, t) for n in maybe)),
        claims=stated,
        verdict=str(result.verdict),
        misseated=len(off),
        overlooked=len(off - outliers),
        accused=len(outliers - off),
        before=error_of(geometry.calibrated, case) if geometry is not None else float("nan"),
        error=error_of(result.calibrated, case),
        seconds=seconds,
    )


def judged_claims(result, is_true) -> tuple[tuple[str, str, float, bool], ...]:
    """As `Judged` has them."""
    return tuple(
        (claim.sentence, claim.confidence, claim.probability, bool(is_true(result, claim, cause)))
        for claim, cause in zip(claims(result), result.causes, strict=True)
    )


def false_names(case: Case, claim) -> tuple[Named, ...]:
    """Names of a claim that are not there; none where it leaves open what may be."""
    if not claim.decided and any(_true(case, n) for n in (*claim.names, *claim.rivals)):
        return ()
    return tuple(n for n in claim.names if not _true(case, n))


def _true(case: Case, name: Named) -> bool:
    """Whether something may be said, in full or without a word on details."""
    whatever = any(a.name == ANY[0] and a.joints == name.joints for a in case.allowed)
    return whatever or any(_same(name, t) for t in (*case.truth, *case.allowed))


def _same(result: Named, truth: Named) -> bool:
    return result == truth or result == Named(truth.name, truth.joints) or result == Named(truth.name)


def error_of(robot, case: Case) -> float:
    """Error of a robot on the noise-free rows, per standard deviation of the noise; NaN without a driver."""
    try:
        seen = tool_poses(robot, Motion.of(case.exact))[:, :3, 3]
    except DataError:
        return float("nan")
    return float(np.sqrt(np.mean((seen - case.exact.position) ** 2))) / case.sigma[0]
