"""What a diagnosis of one virtual arm is worth: what it named, set apart and left, against the truth.

Right is a diagnosis that names every true effect with its joint (a harmonic with its order, a coupling with
both joints, backlash with its cause), and nothing else. Of many compliant joints those that matter must be
named and the others may be. An effect without a name is a local joint error of its joint; a wobbling mount is
right where nothing but joint 1 is blamed, or where nothing is and the verdict admits it.

The saved model is good if its error on the noise-free rows is at most `HALF` of the noise: root mean square
of the position's errors over rows and axes, per standard deviation of the noise per axis.
"""

import time
from dataclasses import asdict, dataclass

import numpy as np
from cases import Case, Named

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.errors import DataError
from workbench.data.dataset import Dataset

HALF = 0.5
ADMITTED = ("partly explained", "unexplained")
"""Verdicts that say that something is left."""


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
        extra: Named effects that are not there.
        verdict: As the diagnosis says it; the error's sentence if it gave none.
        failed: Whether it gave none.
        misseated: How many rows are off.
        overlooked: How many of them were not set apart.
        accused: How many good rows were set apart.
        error: Of the saved model, per standard deviation of the noise; NaN if it gives no poses.
        seconds: What the diagnosis took.
    """

    kind: str
    arm: str
    seed: int
    truth: tuple[Named, ...]
    found: tuple[Named, ...] = ()
    missed: tuple[Named, ...] = ()
    extra: tuple[Named, ...] = ()
    verdict: str = ""
    failed: bool = False
    misseated: int = 0
    overlooked: int = 0
    accused: int = 0
    error: float = float("nan")
    seconds: float = float("nan")

    @property
    def right(self):
        """Whether the names are right."""
        return not (self.failed or self.missed or self.extra)

    @property
    def rows_right(self):
        """Whether all rows that are off were set apart, and at most one other."""
        return not self.failed and self.overlooked == 0 and self.accused <= 1

    @property
    def good(self):
        """Whether the saved model is good."""
        return self.error <= HALF

    def as_json(self):
        """Plain numbers and words."""
        return asdict(self) | {"right": self.right, "good": bool(self.good)}


def judge(case: Case, diagnose, **options) -> Judged:
    """Diagnose one arm and compare.

    Args:
        case: The arm.
        diagnose: Takes its robot and data, gives a diagnosis.
        options: Passed on to it.
    """
    start = time.perf_counter()
    facts = {"kind": case.kind, "arm": case.arm, "seed": case.seed, "truth": case.truth}
    try:
        said = diagnose(case.robot, case.data, **options)
    except Exception as error:  # one that breaks is counted, and the others are still judged
        said = f"{type(error).__name__}: {error}"
        return Judged(**facts, missed=case.truth, verdict=said, failed=True, misseated=len(case.misseated))
    seconds = time.perf_counter() - start
    found = names(said.effects)
    missed, extra = compare(case, found, str(said.verdict))
    off, apart = set(case.misseated), {int(r) for r in said.outliers}
    return Judged(
        **facts,
        found=found,
        missed=missed,
        extra=extra,
        verdict=str(said.verdict),
        misseated=len(off),
        overlooked=len(off - apart),
        accused=len(apart - off),
        error=error_of(said.calibrated, case),
        seconds=seconds,
    )


def names(effects) -> tuple[Named, ...]:
    """What accepted effects are called, one entry a joint and order."""
    out = []
    for effect in (accepted.effect for accepted in effects):
        whole = effect.name == "joint-coupling" or not effect.joints
        details = getattr(effect, "orders", (getattr(effect, "by", None),))
        for joints in [effect.joints] if whole else [(j,) for j in effect.joints]:
            out += [Named(effect.name, joints, detail) for detail in details]
    return tuple(out)


def compare(case: Case, found, verdict):
    """True effects that were missed, and named ones that are not there."""
    if any(t.name == "wobbling mount" for t in case.truth):
        elsewhere = tuple(f for f in found if f.joints != (0,))
        return (() if found or verdict in ADMITTED else case.truth), elsewhere
    missed = tuple(t for t in case.truth if t not in found)
    return missed, tuple(f for f in found if f not in (*case.truth, *case.allowed))


def error_of(robot, case: Case) -> float:
    """Error of a robot on the noise-free rows, per standard deviation of the noise; NaN without a driver."""
    try:
        return _rms(robot, case.exact) / case.sigma[0]
    except DataError:
        return float("nan")


def _rms(robot, rows: Dataset) -> float:
    seen = tool_poses(robot, Motion.of(rows))[:, :3, 3]
    return float(np.sqrt(np.mean((seen - rows.position) ** 2)))
