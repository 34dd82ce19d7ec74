"""Preparation of rows of an instrument from another package, where it decides what the rows may identify."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractReadings
from workbench.identification.consider_covariance import Considered
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise, Problem
from workbench.parts import parts
from workbench.report.json import Json


@dataclass(frozen=True, eq=False, kw_only=True)
class AbstractIdentifiability(ABC):
    """What of the arm some rows may identify, and why.

    Args:
        title: What is identified, such as "joint zeros".
        refused: Why nothing of the arm was identified; "" if something was.
        advice: What to measure next; "" if nothing is needed.
        notes: The decisions and the noise, one sentence each.
        doubts: Given properties of the instrument that the rows contradict.
        actual: Actual scatter of the readings, where all were weighted equally.
        considered: Uncertain constants that were held at nominal.
    """

    title: str
    refused: str
    advice: str
    notes: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    actual: Noise | None = None
    considered: Considered | None = None

    @abstractmethod
    def found(self, fit: Fit) -> Iterator[str]:
        """Sentences on the identified arm and instrument."""

    @abstractmethod
    def json(self, fit: Fit) -> Json:
        """These findings and the decisions, as entries of the JSON result."""


class AbstractPreparation(ABC):
    """Steps for rows with such readings, between their selection and the first search."""

    name: ClassVar[str]
    """What the rows are called, such as "pictures"."""
    readings: ClassVar[type[AbstractReadings]]
    """The rows that it is for."""
    undiagnosed: ClassVar[str]
    """Why these rows are not diagnosed."""

    @abstractmethod
    def contradicted(self, robot: Robot, data: Dataset) -> Mapping[int, str]:
        """Rows that contradict their joint readings, with the reason, before any are held out: indices into
        the data."""

    @abstractmethod
    def suited(self, robot: Robot, data: Dataset) -> Dataset:
        """The rows to fit; unsuitable ones are excluded with the reason."""

    @abstractmethod
    def decide(
        self, robot: Robot, data: Dataset, *, free: Sequence[str], build: Callable[..., Problem]
    ) -> tuple[Problem, AbstractIdentifiability]:
        """The weighed problem of what the rows may identify.

        Args:
            free: Constants of the arm that may be freed at all.
            build: Makes a problem from robot, data and `free`.
        """

    @abstractmethod
    def comparable(self, held: Dataset, fitted: Dataset) -> Dataset:
        """Held-out rows; those that share nothing with the fitted ones are excluded with the reason."""

    @abstractmethod
    def noise_left(self, problem: Problem, x: Float[np.ndarray, " p"]) -> Noise:
        """Noise estimated from the residuals of a solution."""


def preparation_of(data: Dataset) -> AbstractPreparation | None:
    """The preparation that these rows need, if their readings are defined by another package."""
    if data.readings is None:
        return None
    known = parts("preparations", AbstractPreparation)
    return next((p for p in known if isinstance(data.readings, p.readings)), None)
