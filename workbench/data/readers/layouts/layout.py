"""Layouts: files of known origin whose columns need more than names and units to be interpreted."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import ClassVar

import numpy as np

from workbench.base.errors import FileError
from workbench.base.units import Quantity, to_si
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Fields, to_numbers
from workbench.data.readers.table import Table


class AbstractTableLayout(ABC):
    """A table that is recognised by its headings."""

    name: str

    @abstractmethod
    def matches(self, headings: list[str]) -> bool:
        """Whether a table with these headings is of this layout."""

    @abstractmethod
    def read(self, table: Table) -> Fields:
        """The measurements in it, in SI."""


class AbstractFileLayout(ABC):
    """A file or folder that is recognised by its name or first bytes."""

    name: str
    endings: ClassVar[tuple[str, ...]] = ()
    """Of its files' names, in lower case, where they differ from those of tables."""
    is_plain: ClassVar[bool] = False
    """Whether it holds a plain table, and is read where only those are meant, such as trajectories."""

    @abstractmethod
    def matches(self, path: Path, head: bytes) -> bool:
        """Whether a file that begins with these bytes, or a folder (which has none), is of this layout."""

    @abstractmethod
    def read(self, path: Path, naming: Naming | None) -> Fields:
        """What is in it, in SI; `naming` chooses what of it, and may name its joints."""


class Picker:
    """Columns of a table by their exact heading, in SI, gathered for its `Fields`.

    Args:
        table: The table.
    """

    def __init__(self, table: Table):
        self.table = table
        self.values: dict[str, np.ndarray] = {}
        self.headings: dict[str, str] = {}
        self.units: dict[str, str] = {}

    def _index(self, heading: str) -> int:
        if heading not in self.table.headings:
            raise FileError(
                f"this layout needs a column '{heading}'",
                path=self.table.source,
                line=self.table.heading_line,
            )
        return self.table.headings.index(heading)

    def numbers(self, headings: list[str], unit: str, quantity: Quantity) -> list[np.ndarray]:
        """One array (rows,) a column, in SI."""
        return [to_si(to_numbers(self.table, self._index(h)), unit, quantity) for h in headings]

    def take(self, keys: Iterable[str], headings: list[str], unit: str, quantity: Quantity) -> None:
        """Gather columns under our names."""
        self.values |= dict(zip(keys, self.numbers(headings, unit, quantity), strict=True))
        self.note_unit(keys, headings, unit)

    def note_unit(self, keys: Iterable[str], headings: list[str], unit: str) -> None:
        """What the file calls some of our columns, and their unit."""
        self.headings |= dict(zip(keys, headings, strict=True))
        self.units |= dict.fromkeys(keys, unit)

    def text(self, heading: str) -> tuple[str, ...]:
        """Cells of a column as they stand."""
        return self.table.columns[self._index(heading)]

    def fields(self, *notes: str, rotation: np.ndarray | None = None) -> Fields:
        """What was gathered, with orientations and decisions of the layout."""
        return Fields(
            source=self.table.source,
            lines=self.table.lines,
            values=self.values,
            headings=self.headings,
            units=self.units,
            rotation=rotation,
            notes=(*self.table.notes, *notes),
        )
