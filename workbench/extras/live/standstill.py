"""Whether an arm stands still, by the samples of a live source."""

import copy
from collections import deque
from enum import StrEnum
from typing import final

import numpy as np

from workbench.base import se3
from workbench.extras.live.sample import Sample

POSITION_STILL = 1e-3
"""Maximum range of positions that a noisy instrument measures of an arm that stands still [m]."""
ORIENTATION_STILL = float(np.deg2rad(0.2))
"""Likewise of orientations [rad]; the joints decide more sharply."""


class ArmState(StrEnum):
    """Whether the arm stands still."""

    STILL = "stands still"
    MOVING = "is moving, or has only just stopped"
    UNKNOWN = "may be moving: samples are too far apart to be sure"


@final
class StandstillDetector:
    """Decides from the samples of the last window whether the arm stands still.

    Args:
        window: Time that the arm must have stood [s].
        joint: Largest range of any joint [rad or m].
        position: Largest distance of two measured positions' extremes [m].
        orientation: Largest angle from the window's first orientation [rad].
    """

    def __init__(
        self,
        *,
        window: float = 0.5,
        joint: float = 2e-4,
        position: float = POSITION_STILL,
        orientation: float = ORIENTATION_STILL,
    ):
        self.window, self.joint = window, joint
        self.position, self.orientation = position, orientation
        self._seen: deque[Sample] = deque()

    def update(self, sample: Sample) -> bool:
        """Take in a sample; True when all samples of the last window are alike and span it.

        A step back in time (the source was restarted), another number of joints, or a pose that comes or
        goes begins a new window.
        """
        if self._seen and not continues(self._seen[-1], sample):
            self._seen.clear()
        self._seen.append(sample)
        while len(self._seen) > 1 and sample.time - self._seen[1].time >= self.window:
            self._seen.popleft()
        return sample.time - self._seen[0].time >= self.window and self._alike()

    @property
    def seen(self) -> tuple[Sample, ...]:
        """The samples of the last window."""
        return tuple(self._seen)

    def copy(self) -> "StandstillDetector":
        """One with the same tolerances and the same memory, which goes on by itself."""
        other = copy.copy(self)
        other._seen = self._seen.copy()
        return other

    def _alike(self) -> bool:
        q = np.stack([sample.q for sample in self._seen])
        if np.ptp(q, axis=0).max() > self.joint:
            return False
        points = [sample.position for sample in self._seen if sample.position is not None]
        if points and np.linalg.norm(np.ptp(np.stack(points), axis=0)) > self.position:
            return False
        turns = [sample.rotation for sample in self._seen if sample.rotation is not None]
        if not turns:
            return True
        away = se3.matrix_to_rotvec(np.stack(turns) @ turns[0].T)
        return bool(np.linalg.norm(away, axis=-1).max() <= self.orientation)


def continues(last: Sample, sample: Sample) -> bool:
    """Whether a sample follows the last one in the same stream."""
    return (
        sample.time > last.time
        and len(sample.q) == len(last.q)
        and (sample.position is None) == (last.position is None)
        and (sample.rotation is None) == (last.rotation is None)
    )
