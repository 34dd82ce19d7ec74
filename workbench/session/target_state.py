"""How the arm stands at a target."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, eq=False)
class TargetState:
    """The arm's posture at a target.

    Args:
        q: Joint positions: of the solution, or of the nearest that the arm comes [rad or m].
        reached: Whether the tool meets the target within the joint limits.
        branch: Name of the inverse-kinematics solution; empty where none is reached.
        reason: Why it is out of reach; empty where it is reached.
        hit: What the arm would run into there, and with which link, as far as a quick look tells.
    """

    q: Float[np.ndarray, " n"]
    reached: bool
    branch: str = ""
    reason: str = ""
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
