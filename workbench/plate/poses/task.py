"""What a choice of poses is asked for, and the candidates that it has."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.plate.indices import AbstractIndex
from workbench.plate.poses.gradient import PoseClimb
from workbench.plate.poses.limits import PoseLimits, folded, sample_poses, walks
from workbench.plate.poses.sampling import in_base

CANDIDATES, LIMITED_CANDIDATES = 300, 1000
"""Random candidates for a set, where none are given; more where pairs of poses are limited."""
WALK = 25
"""Steps of the random walks that candidates come from where the travel is limited."""

Progress = Callable[[float], None]
Cancel = Callable[[], bool]


class Method(StrEnum):
    """How a set is chosen out of candidates."""

    EXCHANGE = "exchange"
    GREEDY = "greedy"


@dataclass(frozen=True, eq=False)
class PoseTask:
    """One choice of poses.

    Args:
        climb: The arm and the index.
        number: How many poses.
        limits: What else is asked of them.
        candidates: Joint positions to choose from; random ones if None.
        method: How a set is chosen out of candidates.
        rng: Source of the random candidates and starts.
        progress: Called with the share of the work done.
    """

    climb: PoseClimb
    number: int
    limits: PoseLimits
    candidates: np.ndarray | None
    method: Method
    rng: np.random.Generator
    progress: Progress | None

    @property
    def robot(self) -> Robot:
        """The arm."""
        return self.climb.robot

    @property
    def index(self) -> AbstractIndex:
        """What is to become large."""
        return self.climb.index

    def pool(self) -> np.ndarray:
        """The candidates that keep what is asked of single poses."""
        if self.candidates is None:
            count = max(LIMITED_CANDIDATES if self.limits.pairs else CANDIDATES, 5 * self.number)
            drawn = folded(self.robot, sample_poses(self.robot, count, self.limits, rng=self.rng))
            if self.limits.travel is None:
                return drawn
            walked = walks(self.robot, drawn[: max(count // WALK, 1)], WALK, self.limits, rng=self.rng)
            return np.concatenate([drawn, walked])
        kept = self.limits.admits(self.robot, self.candidates)
        if kept.sum() < self.number:
            raise DataError(
                f"{self.number} poses can't be chosen from {len(kept)} candidates of which {kept.sum()} keep "
                "the limits; give more candidates or relax the limits"
            )
        return self.candidates[kept]

    def report(self, share: float) -> None:
        """Tell the share of the work done."""
        if self.progress is not None:
            self.progress(share)

    def blocks(self, pool: np.ndarray) -> np.ndarray:
        """Scaled, whitened Jacobian of each candidate."""
        linearisation = self.climb.at(pool)
        return linearisation.scaled.reshape(len(pool), -1, len(linearisation.names))

    def pairs(self, pool: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Which candidates clash, and which may follow each other."""
        places = in_base(self.robot, tool_poses(self.robot, pool))[:, :3, 3]
        return self.limits.clash(places), self.limits.follow(pool)
