"""How rows of an instrument of another package are prepared, where they decide what they may identify."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.robot import Robot
from workbench.base.registry import Registry
from workbench.data.dataset import Dataset
from workbench.data.readings import AbstractReadings
from workbench.identification.considered import Considered
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise, Problem
from workbench.report.json import Json

Seek = Callable[[Robot, Problem, np.ndarray], tuple[AbstractEffect, ...]]
"""Finds the effects of an arm that a problem's answer leaves unexplained."""


@dataclass(frozen=True, eq=False, kw_only=True)
class AbstractIdentifiability(ABC):
    """What of the arm some rows may identify, and why.

    Args:
        title: What is identified, such as "joint zeros".
        refused: Why the arm stays as it was; "" where something of it was identified.
        advice: What to measure next; "" where nothing has to be.
        uncertainty: Of the tool's position [m] and orientation [rad] from what was identified.
        notes: The decisions and the noise, one sentence each.
        doubts: What was given of the instrument and is contradicted by the rows.
        actual: How readings scatter, where all were weighed alike.
        considered: Constants that stay nominal though they are uncertain.
    """

    title: str
    refused: str
    advice: str
    uncertainty: tuple[float, float]
    notes: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    actual: Noise | None = None
    considered: Considered | None = None

    @abstractmethod
    def found(self, fit: Fit) -> Iterator[str]:
        """Sentences on what a fit found of arm and instrument."""

    @abstractmethod
    def json(self, fit: Fit) -> Json:
        """The same and the decisions, as entries of the result's own."""


class AbstractPreparation(ABC):
    """Rows with such readings: what is done with them between their choice and the first search."""

    name: ClassVar[str]
    """What the rows are called, such as "pictures"."""
    readings: ClassVar[type[AbstractReadings]]
    """The rows that it is for."""
    undiagnosed: ClassVar[str]
    """Why these rows are not diagnosed."""

    @abstractmethod
    def contradicted(self, robot: Robot, data: Dataset) -> Mapping[int, str]:
        """Rows that contradict their joints, with the reason, before any are held out: places in the data."""

    @abstractmethod
    def suited(self, robot: Robot, data: Dataset) -> Dataset:
        """The rows to fit; those that are of no use kept out with the reason."""

    @abstractmethod
    def decide(
        self,
        robot: Robot,
        data: Dataset,
        *,
        free: Sequence[str],
        build: Callable[..., Problem],
        seek: Seek | None,
    ) -> tuple[Problem, AbstractIdentifiability]:
        """The weighed problem of what the rows may identify.

        Args:
            free: Constants of the arm that may be freed at all.
            build: Makes a problem from robot, data and `free`.
            seek: Finds effects beside the geometry; None ends with the geometry.
        """

    @abstractmethod
    def comparable(self, held: Dataset, fitted: Dataset) -> Dataset:
        """Held-out rows; those that show nothing of what the fitted ones show kept out with the reason."""

    @abstractmethod
    def noise_left(self, problem: Problem, x: Float[np.ndarray, " p"]) -> Noise:
        """The noise that an answer leaves."""


PREPARATIONS: Registry[AbstractPreparation] = Registry(
    "preparation", AbstractPreparation, group="workbench.preparations"
)


def preparation_of(data: Dataset) -> AbstractPreparation | None:
    """The preparation that these rows need, if they have readings of another package."""
    if data.readings is None:
        return None
    return next((p for p in PREPARATIONS.values() if isinstance(data.readings, p.readings)), None)
