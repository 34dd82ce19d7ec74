"""The score of a plate: of its set of measurements, and in one branch."""

from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot
from workbench.base.types import Outcome, frozen
from workbench.plate.plate import Plate
from workbench.plate.predicted_error import PredictedError
from workbench.plate.target_branches import Measurable
from workbench.report.result_display import AbstractReported


@dataclass(frozen=True, eq=False, kw_only=True)
class SetScore:
    """Score of a set of measurements at a plate's targets, each measured once.

    Args:
        q: Joint positions at the targets [rad or m]; NaN where they can't be measured, as below.
        branches: Name of each target's branch; empty there.
        per_target: O of each target alone, ARIA eq. (17).
        rises: By what share the predicted error would rise without each target; infinite where others leave
            parameters open.
        indices: O, O1 … O5 and I of the set; of the combinations that measurements anywhere show.
        rank: Combinations of constants that the set determines.
        visible: Number of combinations that any measurements could determine.
        names: The constants that are identified.
        open: Combinations that this set doesn't determine although others would, as columns [rad, m].
        error: Predicted errors at poses of the region, if any are known.
        position: Of these, the root mean square of the position [m]; NaN if unknown.
        rotation: Likewise of the rotation [rad].
        linearisation: The set's Jacobian; `arm`: by the arm's own constants, each target for itself. None: of
            a score that is kept for its numbers.
    """

    q: Float[np.ndarray, "targets n"]
    branches: tuple[str, ...]
    per_target: Float[np.ndarray, " targets"]
    rises: Float[np.ndarray, " targets"]
    indices: dict[str, float]
    rank: int
    visible: int
    names: tuple[str, ...]
    open: Float[np.ndarray, "p missing"]
    error: PredictedError
    position: float
    rotation: float
    linearisation: Linearisation | None
    arm: Linearisation | None

    @property
    def measurable(self) -> int:
        """How many targets count."""
        return int(np.isfinite(self.per_target).sum())

    @property
    def shares(self) -> Float[np.ndarray, " targets"]:
        """Contribution of each target to the index I: the share that would be lost without it; NaN below full
        rank, as of targets that don't count."""
        return frozen(1.0 - 1.0 / (1.0 + self.rises))

    @property
    def stacked(self) -> float:
        """σmin/σmax of the stacked Jacobian as in the paper: unscaled, metres and radians mixed."""
        if self.arm is None:
            return 0.0
        values = np.linalg.svd(self.arm.unwhitened, compute_uv=False)
        full = len(values) == len(self.arm.names) and values[0] > 0
        return float(values[-1] / values[0]) if full else 0.0


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class PlateScore(AbstractReported):
    """A plate's score.

    Args:
        measured: In the branches to be measured.
        single: In the best single branch for all targets; None where no branch reaches all.
        sigma: Standard deviations of the instrument [m], [rad]; they whiten the rows for all indices but O.
        can: The targets that can be measured, and why others can't.
        outcome: How the choice of branches ended.
    """

    plate: Plate
    robot: Robot
    measured: SetScore
    single: SetScore | None
    sigma: tuple[float, float]
    can: Measurable
    outcome: Outcome

    @property
    def left_out(self) -> str:
        """Targets that can't be measured and are ignored, in a sentence; empty if all can."""
        lacking, count = self.can.lacking, len(self.plate)
        if not lacking:
            return ""
        why = "; ".join(f"target {i + 1} is {text}" for i, text in lacking.items())
        many = f"{len(lacking)} of {count} targets of {self.plate.name} can't be measured"
        return f"{many} ({why}); the figures are of the other {count - len(lacking)}"

    @property
    def single_branch(self) -> str:
        """The best single branch; empty where none reaches all targets that the arm can stand at."""
        return "" if self.single is None else max(self.single.branches)
