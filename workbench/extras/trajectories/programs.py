"""Robot programs: joint targets read from their text and written back, everything else unchanged."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from workbench.base.errors import FileError
from workbench.base.files import read_bytes, write_bytes
from workbench.base.registry import Registry
from workbench.data.readers.trajectory import Trajectory

TEXT = "latin-1"
"""Encoding that maps every byte to a character, so that unchanged text is preserved."""
LARGEST = 16 * 2**20


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


PROGRAMS: Registry[AbstractProgramFormat] = Registry(
    "program format", AbstractProgramFormat, group="workbench.programs"
)


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


def read_program(path: Path, joints: int) -> Program | None:
    """A program, by its file extension; None for other files."""
    form = next((f for f in PROGRAMS.values() if path.suffix.lower() in f.endings), None)
    if form is None:
        return None
    text = read_bytes(path, wanted=f"a {form.name} program", maximum=LARGEST).decode(TEXT)
    spans = sorted(tuple(row) for row in form.targets(text, str(path)))
    if not spans:
        raise FileError(f"contains no joint target in {form.name}; check the language", path=str(path))
    for row in spans:
        if len(row) != joints:
            line = text.count("\n", 0, row[0][0]) + 1
            raise FileError(
                f"a target of {len(row)} joints, but the robot has {joints}", path=str(path), line=line
            )
    q = np.array([[float(text[a:b]) for a, b in row] for row in spans]) * form.unit
    return Program(text, form, tuple(spans), q, str(path))
