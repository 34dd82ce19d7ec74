"""What an instrument of another package saw, where none of `Dataset`'s own columns can hold it."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from jaxtyping import Bool, Float, Int


class AbstractReadings(ABC):
    """Readings of one instrument, one a row, with all that is known of it; its observation knows them."""

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
