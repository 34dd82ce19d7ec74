"""The interface of an observation: residual = measured − predicted, and derivatives of the prediction.

An observation holds the rows that it sees. Its prediction depends on the tool's pose and on unknowns of
its own (an anchor, a contact point, marker offsets); both derivatives are given in closed form, so that
the identification Jacobian is `by_twist @ twists` for the robot's constants and `by_unknown` for the rest.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, NamedTuple, dataclass_transform

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.columns import COLUMNS, Column
from workbench.base.errors import OptionError
from workbench.parts import parts

if TYPE_CHECKING:
    from workbench.data.dataset import Dataset


class Channel(StrEnum):
    """What a residual component measures, and so which standard deviation whitens it."""

    POSITION = "position"
    ROTATION = "rotation"
    OWN = "own"
    """In a unit of the observation's own, such as px."""
    TILT = "tilt"


class Unknown(NamedTuple):
    """What is known of an observation's unknown before it is identified.

    Args:
        unit: What it is measured in.
        natural: Change that moves the observation as 1 m or 1 rad of the arm does.
        sigma: Standard deviation of its first guess; None where nothing is known.
    """

    unit: str = "m"
    natural: float = 1.0
    sigma: float | None = None


class Linearised(NamedTuple):
    """Residuals and derivatives of some rows.

    Args:
        residual: Measured minus predicted [m, rad or its own unit].
        by_twist: Change of the prediction per twist [v; w] of the tool, base axes.
        by_unknown: Change of the prediction per unknown of the observation.
    """

    residual: Float[np.ndarray, "rows m"]
    by_twist: Float[np.ndarray, "rows m 6"]
    by_unknown: Float[np.ndarray, "rows m u"]


class OwnErrors(NamedTuple):
    """Errors of rows that were measured in a unit of the observation's own.

    Args:
        name: What `size` is of, and its unit: "pixel[px]".
        size: Root mean square of each row's readings, in that unit.
        number: How many readings each row has.
        position: What they lead one to expect at the tool [m].
        rotation: The same of its orientation [rad].
    """

    name: str
    size: Float[np.ndarray, " rows"]
    number: Float[np.ndarray, " rows"]
    position: Float[np.ndarray, " rows"]
    rotation: Float[np.ndarray, " rows"]


@dataclass_transform(frozen_default=True, eq_default=False)
class AbstractObservation(ABC):
    """Rows that were observed in one way; every class of this kind is a frozen dataclass."""

    columns: ClassVar[tuple[str, ...]] = ()
    """Columns of numbers that a row must have whole, in the order of the fields."""
    brings: ClassVar[tuple[Column, ...]] = ()
    """Columns of files that nobody else knows: they are read into `Dataset.more`."""
    sees_base: bool = True
    """Whether the base frame can be seen at all (contacts between unknown points can't)."""
    sees_tool: bool = True
    """Whether it sees the tool at all (an inclinometer on a link does not)."""
    sees_tool_rotation: bool = False
    """Whether the tool's orientation can be seen."""
    is_tool_free: bool = False
    """Whether it has unknowns of its own in place of the tool frame, which then stays at nominal."""
    link: int | None = None
    """The moving link, counted from 1, that it watches from a level frame; None for the tool in the measuring
    frame, whose poses and twists the others are given."""
    unused_text: str = ""
    """What a row carries in vain if another observation of it is used; empty if that one contains it."""

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False)(cls)

    @classmethod
    def applies(cls, data: "Dataset") -> Bool[np.ndarray, " rows"]:
        """Rows that carry it: by default those with all its columns."""
        values = [v for name in cls.columns if (v := data.column(name)) is not None]
        if len(values) < len(cls.columns):
            return np.zeros(len(data), bool)
        return np.all([np.isfinite(v).all(axis=tuple(range(1, v.ndim))) for v in values], axis=0)

    @classmethod
    def check_part(cls) -> None:
        """Refuse another package's observation that no rows carry, or that brings a known column."""
        if not cls.columns and cls.applies.__func__ is AbstractObservation.applies.__func__:  # type: ignore[attr-defined]
            raise OptionError(f"{cls.__name__} needs columns, or `applies` that says which rows carry it")
        if taken := next((column.name for column in cls.brings if column.name in COLUMNS), None):
            raise OptionError(f"{cls.__name__} brings the column '{taken}', which is known already")

    @classmethod
    def of(cls, data: "Dataset") -> "AbstractObservation":
        """The observation of rows that all carry it, by default made of its columns."""
        return cls(*(np.asarray(data.column(name)) for name in cls.columns))

    @classmethod
    def each(cls, data: "Dataset") -> tuple["AbstractObservation", ...]:
        """The observations of rows that all carry it: one, unless several links were watched at once."""
        return (cls.of(data),)

    @property
    @abstractmethod
    def channels(self) -> tuple[Channel, ...]:
        """Meaning of each of the m residual components."""

    @property
    def seen(self) -> Bool[np.ndarray, "..."]:
        """Which components of which rows were measured; all by default."""
        return np.ones((1, len(self.channels)), bool)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of what has to be found with the robot, such as `anchor[A].x` [m]."""
        return ()

    @property
    def known(self) -> Mapping[str, Unknown]:
        """What is known of them; those that are not named are lengths that may be anything."""
        return {}

    def start(self, poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, " u"]:
        """First guess of the unknowns from predicted tool poses; 0 by default."""
        return np.zeros(len(self.unknowns))

    @abstractmethod
    def linearise(self, poses: Float[np.ndarray, "rows 4 4"], unknown: Float[np.ndarray, " u"]) -> Linearised:
        """Residuals and derivatives at predicted tool poses."""

    def own_errors(self, seen: Linearised) -> OwnErrors | None:
        """Errors of the rows, where these are neither positions nor orientations."""
        return None


class AbstractReadings(ABC):
    """What an instrument of another package saw, one reading a row, where none of `Dataset`'s own columns can
    hold it, with all that is known of it; its observation knows them."""

    frames: ClassVar[tuple[str, ...]] = ()
    """Names of its own poses that a turn of a joint may be mistaken for, such as "camera"."""

    @abstractmethod
    def __len__(self) -> int:
        """How many rows there are."""

    @abstractmethod
    def take(self, rows: Int[np.ndarray, " k"] | Bool[np.ndarray, " rows"]) -> "AbstractReadings":
        """The chosen rows."""

    @abstractmethod
    def joined(self, other: "AbstractReadings | None") -> "AbstractReadings | None":
        """These rows and then the other's, where their errors are to be judged together; None where not."""

    @property
    @abstractmethod
    def has_tool_poses(self) -> bool:
        """Whether poses of the tool came in place of joints, so that the arm is `posed_arm`."""

    @property
    @abstractmethod
    def numbers(self) -> Float[np.ndarray, "rows k"]:
        """What was read, by which repeated rows are recognised."""

    @property
    @abstractmethod
    def sights(self) -> Float[np.ndarray, "rows 4 4"]:
        """Pose of what the tool carries in what stands still, from each row alone, by one pair of frames on
        both that nobody need know; NaN where a row doesn't show it."""


def known_columns() -> dict[str, Column]:
    """All columns that a file may have: the table in `base/columns.py`, and those that observations bring."""
    kinds = parts("observations", AbstractObservation, classes=True)
    return {c.name: c for c in (*(c for kind in kinds for c in kind.brings), *COLUMNS.values())}
