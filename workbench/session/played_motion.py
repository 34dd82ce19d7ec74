"""A planned motion of the arm, and how far the page has played it."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.session.part import AbstractPart


class AbstractMotion(ABC):
    """What an extra plans for the arm, that the page can play."""

    @property
    @abstractmethod
    def duration(self) -> float:
        """How long it takes at its own pace [s]."""

    @abstractmethod
    def view(self) -> Float[np.ndarray, "rows 3"]:
        """Places that a page looks at when it is new, base frame [m]."""

    @abstractmethod
    def looks_like(self, other: "AbstractMotion") -> bool:
        """Whether a page that looks at the other one need not turn to it."""

    @abstractmethod
    def at(self, time: float) -> Float[np.ndarray, " n"]:
        """Joint positions at a time [rad or m]."""


@final
@dataclass(frozen=True, kw_only=True)
class Played(AbstractPart):
    """How far a motion is played.

    Args:
        at: Time along it [s]; while it runs, where it began to.
        pace: How many times faster than its own time.
        is_running: Whether it was begun, and nothing has said yet where it stopped.
        is_pausing: Whether it is to stop.
    """

    motion: AbstractMotion
    at: float = 0.0
    pace: float = 1.0
    is_running: bool = False
    is_pausing: bool = False

    @property
    def joints(self) -> Float[np.ndarray, " n"]:
        return self.motion.at(self.at)

    def stopped(self, at: float) -> "Played":
        """Nothing runs, at this time [s]."""
        return Played(motion=self.motion, at=at, pace=self.pace)
