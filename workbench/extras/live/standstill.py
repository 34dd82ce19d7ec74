"""Whether an arm stands still, by the samples of a live source."""

from collections import deque
from enum import StrEnum
from typing import final

import numpy as np

from workbench.base import se3
from workbench.extras.live.sample import Sample

WINDOW = 0.5
"""Time that the arm must have stood [s]."""
JOINT_STILL = 2e-4
"""Maximum range of any joint of an arm that stands still [rad or m]."""
POSITION_STILL = 1e-3
"""Maximum range of its measured positions [m], beyond the instrument's noise."""
ORIENTATION_STILL = float(np.deg2rad(0.2))
"""Maximum angle from the first of its measured orientations [rad], likewise."""
NOISY = 10.0
"""Extent of an instrument's noise in a window, in standard deviations, at most."""

THINNED = 0.02
"""Samples that follow the last one sooner than this are not looked at [s]."""


class ArmState(StrEnum):
    """Whether the arm stands still."""

    STILL = "stands still"
    MOVING = "is moving, or has only just stopped"
    UNKNOWN = "may be moving: samples are too far apart to be sure"


@final
class StandstillDetector:
    """Decides from the samples of the last window whether the arm stands still."""

    def __init__(self) -> None:
        self._seen: deque[Sample] = deque()
        self._state = ArmState.UNKNOWN

    def update(self, sample: Sample, noise: tuple[float, float] = (0.0, 0.0)) -> ArmState:
        """Take in a sample: the arm stands still if all of the last window are alike and span it.

        Args:
            noise: Standard deviations of the measured position [m] and orientation [rad].
        """
        last = self._seen[-1] if self._seen else None
        if last is not None and 0.0 <= sample.time - last.time < THINNED and not sample.capture:
            return self._state
        if last is not None and not _continues(last, sample):
            self._seen.clear()
        self._seen.append(sample)
        while len(self._seen) > 1 and sample.time - self._seen[1].time >= WINDOW:
            self._seen.popleft()
        if sample.time - self._seen[0].time >= WINDOW and self._are_alike(*noise):
            self._state = ArmState.STILL
        else:
            seldom = last is None or sample.time - last.time > WINDOW / 2.0
            self._state = ArmState.UNKNOWN if seldom else ArmState.MOVING
        return self._state

    def _are_alike(self, sigma_position: float, sigma_rotation: float) -> bool:
        if np.ptp([sample.q for sample in self._seen], axis=0).max() > JOINT_STILL:
            return False
        points = [sample.position for sample in self._seen if sample.position is not None]
        if points and np.linalg.norm(np.ptp(points, axis=0)) > max(POSITION_STILL, NOISY * sigma_position):
            return False
        turns = [sample.rotation for sample in self._seen if sample.rotation is not None]
        away = se3.matrix_to_rotvec(np.stack(turns) @ turns[0].T) if turns else np.zeros((1, 3))
        return bool(np.linalg.norm(away, axis=-1).max() <= max(ORIENTATION_STILL, NOISY * sigma_rotation))


def _continues(last: Sample, sample: Sample) -> bool:
    """Whether a sample follows the last one in the same stream."""
    return (
        sample.time > last.time
        and len(sample.q) == len(last.q)
        and (sample.position is None) == (last.position is None)
        and (sample.rotation is None) == (last.rotation is None)
    )
