"""What an instrument must see of an arm's poses, and the information it then gives."""

from abc import ABC, abstractmethod

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.linearisation import Linearisation
from workbench.arm.robot import Robot


class AbstractSight(ABC):
    """An instrument and its object, with approximate poses."""

    condition: str
    """Condition on joint positions, as in "show the target in the picture"."""
    remedy: str
    """What to correct if too few meet it."""

    @abstractmethod
    def admits(self, robot: Robot, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
        """At which joint positions it sees enough."""

    @abstractmethod
    def linearise(
        self, robot: Robot, q: Float[np.ndarray, "rows n"], names: tuple[str, ...] | None = None
    ) -> Linearisation:
        """Linearisation of the poses that it gives: six rows each, whitened by its noise there."""
