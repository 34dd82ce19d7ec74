"""A guided measurement under way: what is wanted, what has been stored, and the arm that is driven there."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.measure.acquisition import Acquisition
from workbench.measure.instruments import Instrument
from workbench.robots.robot import Robot


@dataclass(frozen=True, eq=False, kw_only=True)
class Ride:
    """One way of the virtual arm, from where it stands to a target.

    Args:
        number: Counts up in a measurement; also the seed of its noise.
        start: Joint positions at its beginning [rad or m].
        end: At its end.
        clock: Time of its first sample [s].
    """

    number: int
    start: Float[np.ndarray, " n"]
    end: Float[np.ndarray, " n"]
    clock: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Measuring:
    """A guided measurement of a virtual arm.

    Args:
        acquisition: Rows and standstill; never changed, a command works on a copy.
        seed: Of the arm's hidden errors and of the noise.
        actual: The virtual arm, hidden from every computation.
        instrument: What sees its tool all the while.
        numbers: Which targets of the plate are measured, counted from 0.
        postures: Joint positions at which the arm meets them, as well as an operator steers [rad or m].
        ride: The last way that the arm was sent.
    """

    acquisition: Acquisition
    seed: int
    actual: Robot
    instrument: Instrument
    numbers: tuple[int, ...]
    postures: Float[np.ndarray, "targets n"]
    ride: Ride | None = None

    @property
    def target(self) -> int:
        """The target of the plate that is wanted, counted from 0."""
        return self.numbers[self.acquisition.capture.current]
