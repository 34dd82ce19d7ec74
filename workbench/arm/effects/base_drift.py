"""Base drift: the measuring frame drifts with time.

    Δv = c (t − t_ref)

for the base's position, along the axes of the measuring frame, and for three rotations behind its own, about
the axes of the base; c [m/s] and [rad/s]. Gravity stays fixed to the arm: the instrument drifts. Without
times, t is the row in the file, c is in [m] and [rad] per row, and poses outside any file don't drift.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import PART_UNITS, Insertion, Wrenches
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, offered
from workbench.arm.frame import FRAME_PARTS
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

SAME, LATER, RETURNS = 0.01, 0.2, 3
"""Share of each joint's range within which two postures are the same, share of the total time by which they
must be apart, and minimum number of such repeated rows to separate time from posture."""
MIN_MIXED_SHARE = 0.5
"""Share of rows whose nearest posture must be much earlier or later for row order to represent time: if
postures follow a path, a drift with the rows is confounded with errors of the geometry along it."""


def _returns(q: Float[np.ndarray, "rows n"], time: Float[np.ndarray, " rows"]) -> int:
    """Number of rows that repeat an earlier posture later."""
    place = q / np.maximum(SAME * np.ptp(q, axis=0), 1e-9)
    pairs = cKDTree(place).query_pairs(1.0, p=np.inf, output_type="ndarray")
    later = np.abs(time[pairs[:, 0]] - time[pairs[:, 1]]) > LATER * np.ptp(time)
    first, second = pairs[later].T
    return len(np.unique(np.where(time[first] > time[second], first, second)))


def mixed_share(q: Float[np.ndarray, "rows n"], time: Float[np.ndarray, " rows"]) -> float:
    """Share of rows whose nearest posture is much earlier or later: 0.64 in random order."""
    place = q / np.maximum(np.ptp(q, axis=0), 1e-9)
    nearest = cKDTree(place).query(place, k=2)[1][:, 1] if len(q) > 1 else np.zeros(len(q), int)
    return float((np.abs(time[nearest] - time) > LATER * np.ptp(time)).mean())


@final
@dataclass(frozen=True)
class BaseDrift(AbstractEffect):
    """Six coefficients.

    Args:
        reference: Time t_ref at which the base has its stated pose [s, or rows].
        by_row: Whether row numbers are used instead of times.
    """

    reference: float = 0.0
    by_row: bool = False
    name = "base-drift"
    does = "the measuring frame drifts", "the measuring frame drifts"
    insertion = Insertion.DRIFT
    needs = ("time",)
    whole_arm = True
    moves_arm = False
    credible = (0.01, 0.01)
    """Over all rows: a tripod that settles or warms moves by some 0.1 mm and 0.1 mrad an hour; one that moved
    farther than 10 mm or 10 mrad was knocked."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"drift.{part}" for part in FRAME_PARTS)

    def units(self, chain: Chain) -> tuple[str, ...]:
        return PART_UNITS if self.by_row else tuple(f"{unit}/s" for unit in PART_UNITS)

    @property
    def variant(self) -> str:
        return "by row" if self.by_row else ""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return (self._clock(motion) - self.reference)[:, None, None] * np.eye(len(FRAME_PARTS))

    def _clock(self, motion: Motion) -> Float[np.ndarray, " rows"]:
        """Its driver [s, or rows]."""
        if not self.by_row:
            return motion.need("time", self.name)
        return np.full(len(motion), self.reference) if motion.row is None else motion.row.astype(float)

    def doubt(self, motion: Motion) -> str | None:
        """Only repeated postures separate time from posture."""
        if self.by_row:
            return "the rows have no times, so their order in the file was used"
        if _returns(motion.q, self._clock(motion)) >= RETURNS:
            return None
        return "no pose was repeated later, which would be needed to confirm it"

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        """From the first row on; by row number without times, if postures are in random order."""
        begin = 0.0 if motion.time is None else float(np.min(motion.time))
        found = list(offered([cls(reference=begin)], arm, motion))
        yield from found
        if any(isinstance(f, Candidate) for f in found) or motion.row is None:
            return
        if mixed_share(motion.q, motion.row.astype(float)) > MIN_MIXED_SHARE:
            yield Candidate(cls(reference=float(np.min(motion.row)), by_row=True))

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "BaseDrift":
        """Along and about random directions."""
        directions = (rng.normal(size=3) for _ in range(2))
        return cls((), tuple(v for d in directions for v in (d / np.linalg.norm(d)).tolist()))
