"""Measurements of a session, how they were interpreted, and the running guided measurement."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.live.acquisition import Acquisition
from workbench.data.readers.preview import Preview
from workbench.data.simulation.instruments import Instrument
from workbench.identification.arm_match import ArmMatch


@dataclass(frozen=True, eq=False)
class MeasurementFile:
    """A file and the interpretation of its columns, whether or not it could be read that way.

    Args:
        name: Its name.
        content: Its bytes.
        preview: What was understood.
        mapping: What its columns were said to be (TOML); empty: as its headings say.
        match: Which arm its rows are of, where they have another number of joints than the session's.
    """

    name: str
    content: bytes
    preview: Preview
    mapping: bytes = b""
    match: ArmMatch | None = None


@dataclass(frozen=True, eq=False)
class Loaded:
    """Measurements, and how they were interpreted.

    Args:
        dataset: The rows.
        name: File name, or how they came to be.
        facts: Pairs of a heading and what was understood.
        notes: Decisions that the reader took, one sentence each.
        virtual: Whether a virtual arm made them.
        checks: Rows that are measured for checking only and never fitted.
        actual: The virtual arm that was measured, hidden from every computation.
        read: The rows as they were read, before anything was said of them for an arm; None: virtual ones.
        match: How well they and the arm go together; None: not asked.
        file: Where they were read; None: virtual ones.
    """

    dataset: Dataset
    name: str
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    virtual: bool = False
    checks: Dataset | None = None
    actual: Robot | None = None
    read: Dataset | None = None
    match: ArmMatch | None = None
    file: MeasurementFile | None = None

    @property
    def is_foreign(self) -> bool:
        """Whether these are clearly another arm's rows."""
        return self.match is not None and self.match.is_foreign


@dataclass(frozen=True, eq=False, kw_only=True)
class VirtualMotion:
    """One motion of the virtual arm, from where it stands to a target.

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
        ride: The last motion that was asked of the virtual arm.
    """

    acquisition: Acquisition
    numbers: tuple[int, ...]
    virtual: VirtualArm | None = None
    ride: VirtualMotion | None = None

    @property
    def target(self) -> int:
        """The target of the plate that is wanted, counted from 0."""
        return self.numbers[self.acquisition.capture.current]
