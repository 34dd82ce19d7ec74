"""Robot programs: joint targets read from their text and written back, everything else unchanged."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from workbench.base.files import write_bytes
from workbench.data.readers.trajectory import Trajectory

TEXT = "latin-1"
"""Encoding that maps every byte to a character, so that unchanged text is preserved."""


class AbstractProgramFormat(ABC):
    """One language."""

    name: ClassVar[str]
    endings: ClassVar[tuple[str, ...]]
    unit: ClassVar[float]
    """Radians in one of its units."""
    decimals: ClassVar[int]
    """Minimum number of decimals written."""

    @abstractmethod
    def targets(self, text: str, path: str) -> Iterable[list[tuple[int, int]]]:
        """Start and end of each number of each joint target in the text."""


@dataclass(frozen=True, eq=False)
class Program:
    """A program with its joint targets.

    Args:
        spans: Start and end of each number in the text, one row per target.
        q: The targets [rad].
    """

    text: str
    form: AbstractProgramFormat
    spans: tuple[tuple[tuple[int, int], ...], ...]
    q: Float[np.ndarray, "targets n"]
    source: str

    @property
    def trajectory(self) -> Trajectory:
        """The targets as a list of poses."""
        return Trajectory(time=None, q=self.q, position=None, rotation=None, source=self.source, notes=())

    @property
    def lines(self) -> list[int]:
        """The line of each target, counted from 1."""
        return [self.text.count("\n", 0, row[0][0]) + 1 for row in self.spans]

    def save(self, q: Float[np.ndarray, "targets n"], path: Path) -> Path:
        """Write the program with other joint targets, and everything else unchanged."""
        places = [span for row in self.spans for span in row]
        text, at = [], 0
        for (begin, end), value in sorted(zip(places, (q / self.form.unit).ravel().tolist(), strict=True)):
            shown = len(self.text[begin:end].partition(".")[2])
            text += [self.text[at:begin], f"{value:.{max(shown, self.form.decimals)}f}"]
            at = end
        return write_bytes(path, "".join([*text, self.text[at:]]).encode(TEXT))
