"""A candidate: an effect that might be missing, with what is known of its size beforehand."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.effects.local_joint_error import LocalJointError

NAMELESS = 6.0
"""Log evidence that a shape without a name must have beyond the best effect with one."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that is tried.

    Args:
        effect: With zero coefficients.
        covariance: Of its coefficients up to a common factor, where they are many and shrunk together; None
            for a few free ones.
    """

    effect: AbstractEffect
    covariance: Float[np.ndarray, "k k"] | None = None

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of its coefficients."""
        return self.effect.names

    @property
    def shrunk(self) -> bool:
        """Whether its coefficients share a variance that the data decide."""
        return self.covariance is not None

    @cached_property
    def root(self) -> Float[np.ndarray, "k k"]:
        """Lower root of the covariance."""
        assert self.covariance is not None, "only shrunk candidates have one"
        return np.linalg.cholesky(self.covariance)

    @property
    def handicap(self) -> float:
        """Log evidence that it must bring beyond a named effect."""
        return NAMELESS if isinstance(self.effect, LocalJointError) else 0.0

    @property
    def maps_joint(self) -> bool:
        """Whether it is an error of one joint over the joint's own position, of which one is enough."""
        return isinstance(self.effect, JointHarmonic | LocalJointError)

    def excludes(self, other: "Candidate") -> bool:
        """Whether the two can't stand in one model: one holds the other, or a part of it."""
        if set(self.names) & set(other.names):
            return True
        alike = self.maps_joint and other.maps_joint and self.effect.joints == other.effect.joints
        return alike and (self.shrunk or other.shrunk)
