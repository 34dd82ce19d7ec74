"""Choices of poses by an index that other packages add to those of simulated measurements."""

from abc import ABC, abstractmethod
from collections.abc import Collection

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.parts import parts


class AbstractPoseChoice(ABC):
    """Joint positions that determine an arm well."""

    name: str
    indices: Collection[str]
    """Indices that it can maximise."""

    @abstractmethod
    def choose(
        self, robot: Robot, number: int, *, index: str, rng: np.random.Generator
    ) -> Float[np.ndarray, "number n"]:
        """So many joint positions within the limits [rad or m]."""


def pose_choices() -> tuple[AbstractPoseChoice, ...]:
    return parts("pose_choices", AbstractPoseChoice)
