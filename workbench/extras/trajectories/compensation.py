"""A corrected trajectory, with its predicted errors."""

from dataclasses import dataclass
from enum import StrEnum
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.motion import Motion
from workbench.extras.trajectories.path import Commanded
from workbench.report.result_display import AbstractReported

ACCEPTED_ERROR = 1e-6
"""Remaining error of an iterated correction above which it is reported [m]."""


class CorrectionMethod(StrEnum):
    """How a trajectory is corrected."""

    ONE_STEP = "one-step"
    ITERATED = "iterated"


@dataclass(frozen=True, eq=False)
class PathErrors:
    """Errors of an arm along a path, row by row.

    Args:
        position: Distance from the commanded position [m].
        rotation: Angle to the commanded orientation, as far as the task requires [rad].
    """

    position: Float[np.ndarray, " rows"]
    rotation: Float[np.ndarray, " rows"]


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Compensation(AbstractReported):
    """A corrected trajectory.

    Args:
        commanded: The path as commanded.
        motion: The corrected joint positions, with drivers of effects.
        before: Predicted errors of the calibrated arm without correction.
        after: Its predicted errors with it.
        kept: Uncorrected rows, which a correction would have made worse.
        speed: Maximum speed of every joint with the correction [rad/s or m/s]; None without time.
    """

    commanded: Commanded
    motion: Motion
    method: CorrectionMethod
    before: PathErrors
    after: PathErrors
    kept: Bool[np.ndarray, " rows"]
    speed: Float[np.ndarray, " n"] | None
    notes: tuple[str, ...]

    @property
    def q(self) -> Float[np.ndarray, "rows n"]:
        """Corrected joint positions [rad or m]."""
        return self.motion.q
