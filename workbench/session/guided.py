"""A guided measurement under way: what is wanted, what has been stored, and the arm that is driven there."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.data.live.acquisition import Acquisition
from workbench.data.simulation.instruments import Instrument


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
class VirtualArm:
    """A virtual arm that can be driven.

    Args:
        seed: Of its hidden errors and of the noise.
        actual: The arm, hidden from every computation.
        instrument: What sees its tool all the while.
        postures: Joint positions at which it meets the targets, as well as an operator steers [rad or m].
    """

    seed: int
    actual: Robot
    instrument: Instrument
    postures: Float[np.ndarray, "targets n"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Measuring:
    """A guided measurement.

    Args:
        acquisition: Rows and standstill; never changed, a command works on a copy.
        numbers: Which targets of the plate are measured, counted from 0.
        virtual: The virtual arm that is measured; None: a live source tells of a real one.
        ride: The last way that the virtual arm was sent.
    """

    acquisition: Acquisition
    numbers: tuple[int, ...]
    virtual: VirtualArm | None = None
    ride: Ride | None = None

    @property
    def target(self) -> int:
        """The target of the plate that is wanted, counted from 0."""
        return self.numbers[self.acquisition.capture.current]
