"""Preparation of rows between their selection and the first search, where an instrument of another package
may decide what they identify."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.observation import AbstractReadings
from workbench.identification.consider_covariance import Considered
from workbench.identification.fit import Fit
from workbench.identification.noise import beyond_stated
from workbench.identification.problem import Noise, Problem
from workbench.parts import parts
from workbench.report.json import Json


@dataclass(frozen=True, eq=False, kw_only=True)
class AbstractIdentifiability:
    """What of the arm some rows may identify, and why; by default all that is free.

    Args:
        title: What is identified, such as "joint zeros"; "" if the kind of reading sets no limit.
        refused: Why nothing of the arm was identified; "" if something was.
        advice: What to measure next; "" if nothing is needed.
        notes: The decisions and the noise, one sentence each.
        doubts: Given properties of the instrument that the rows contradict.
        actual: Actual scatter of the readings, where all were weighted equally.
        considered: Uncertain constants that were held at nominal.
    """

    title: str = ""
    refused: str = ""
    advice: str = ""
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    actual: Noise | None = None
    considered: Considered | None = None

    @property
    def is_limited(self) -> bool:
        """Whether the kind of reading decides: it then checks and weighs its rows by itself."""
        return self.title != ""

    def found(self, fit: Fit) -> Iterable[str]:
        """Sentences on the identified arm and instrument."""
        return ()

    def json(self, fit: Fit) -> Json:
        """These findings and the decisions, as entries of the JSON result."""
        return {}


@final
class Unlimited(AbstractIdentifiability):
    """All that is free."""


class AbstractPreparation:
    """Steps between the selection of rows and the first search; by default those of rows of columns."""

    readings: ClassVar[type[AbstractReadings]]
    """The rows that it is for."""
    undiagnosed: ClassVar[str] = ""
    """Why these rows are not diagnosed; "" if they are."""

    def contradicted(self, robot: Robot, data: Dataset) -> Mapping[int, str]:
        """Rows that contradict their joint readings, with the reason, before any are held out: indices into
        the data."""
        return {}

    def suited(self, robot: Robot, data: Dataset) -> Dataset:
        """The rows to fit; unsuitable ones are excluded with the reason."""
        return data

    def decide(
        self, robot: Robot, data: Dataset, *, free: Sequence[str], build: Callable[..., Problem]
    ) -> tuple[Problem, AbstractIdentifiability]:
        """The problem of what the rows may identify; weighed where that is limited.

        Args:
            free: Constants of the arm that may be freed at all.
            build: Makes a problem from robot, data and `free`.
        """
        return build(robot, data, free=free), Unlimited()

    def comparable(self, held: Dataset, fitted: Dataset) -> Dataset:
        """Held-out rows; those that share nothing with the fitted ones are excluded with the reason."""
        return held

    def noise_left(self, problem: Problem, x: Float[np.ndarray, " p"]) -> Noise | None:
        """Noise estimated from the residuals of a solution; None if that is rounding or unknown."""
        return beyond_stated(problem, x)


@final
class ColumnPreparation(AbstractPreparation):
    """Of rows of columns."""


COLUMNS = ColumnPreparation()


def preparation_of(data: Dataset) -> AbstractPreparation:
    """The preparation that these rows need."""
    known = () if data.readings is None else parts("preparations", AbstractPreparation)
    return next((p for p in known if isinstance(data.readings, p.readings)), COLUMNS)
