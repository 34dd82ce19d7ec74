"""How the arm stands at the targets, and what they would tell about it together."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import Linearisation


@dataclass(frozen=True, eq=False)
class TargetState:
    """The arm's posture at a target.

    Args:
        q: Joint positions: of the solution, or of the nearest that the arm comes [rad or m].
        reached: Whether the tool meets the target within the joint limits.
        branch: Name of the inverse-kinematics solution; empty where none is reached.
        reason: Why it is out of reach; empty where it is reached.
        missing: Distance that is missing [m] and angle [rad].
        hit: What the arm would run into there, and with which link, as far as a quick look tells.
    """

    q: Float[np.ndarray, " n"]
    reached: bool
    branch: str = ""
    reason: str = ""
    missing: tuple[float, float] = (0.0, 0.0)
    hit: str = ""

    @property
    def measurable(self) -> bool:
        """Whether the arm can stand there: the target is reached, and nothing is in the way."""
        return self.reached and not self.hit

    @property
    def obstacle(self) -> str:
        """Why the target can't be measured, in words; empty where it can."""
        if not self.reached:
            return "out of reach"
        return f"blocked ({self.hit})" if self.hit else ""


@dataclass(frozen=True, eq=False)
class Score:
    """How well the current targets would determine the robot.

    Args:
        per_target: Index O of each target alone (ARIA eq. 17); NaN where it can't be measured.
        indices: O and O1 … O5 of the measurable targets together.
        measurable: How many targets count: the arm reaches them and runs into nothing there.
        rank: Parameter combinations that the set determines.
        parameters: How many measurements anywhere could determine.
        condition: Condition number of the scaled Jacobian; infinite below full rank.
        position: Predicted position error in the region after calibration, rms [m]; NaN if unknown.
        rotation: Predicted rotation error there, rms [rad]; NaN if unknown.
        rises: By what share the predicted error would rise without each target; NaN where nothing is lost.
        worst: Worst-determined parameters first: name, standard error and its unit (m or rad).
        linearisation: The measurable targets' Jacobian; None without any.
    """

    per_target: Float[np.ndarray, " targets"]
    indices: dict[str, float]
    measurable: int
    rank: int
    parameters: int
    condition: float
    position: float
    rotation: float
    rises: Float[np.ndarray, " targets"]
    worst: tuple[tuple[str, float, str], ...] = ()
    linearisation: Linearisation | None = None
