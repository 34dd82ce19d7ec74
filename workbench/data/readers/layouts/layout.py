"""Layouts: files of a known origin whose columns need more than names and units to be understood."""

from abc import ABC, abstractmethod
from pathlib import Path

import numpy as np

from workbench.base.errors import FileError
from workbench.base.progress import Cancel
from workbench.base.units import Quantity, to_si
from workbench.data.readers.columns_option import Naming
from workbench.data.readers.fields import Decimal, Fields, decimal_of, to_numbers
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


class AbstractFolderLayout(ABC):
    """A folder of files, or one file of it."""

    name: str

    @abstractmethod
    def matches(self, path: Path) -> bool:
        """Whether a folder or file is of this layout."""

    @abstractmethod
    def refuses(self, path: Path) -> bool:
        """Whether a file comes from such a folder but holds no measurements."""

    @abstractmethod
    def read(self, path: Path) -> Fields:
        """The measurements in it, in SI."""


class AbstractFileLayout(ABC):
    """A file, or the folder of one, that is recognised by its name or first bytes."""

    name: str

    @abstractmethod
    def matches(self, path: Path, head: bytes) -> bool:
        """Whether a file that begins with these bytes, or a folder (which has none), is of this layout."""

    @abstractmethod
    def read(self, path: Path, naming: Naming | None, cancel: Cancel) -> Fields:
        """What is in it, in SI; `naming` chooses what of it, and may name its joints."""


class Picker:
    """Columns of a table by their exact heading, in SI.

    Args:
        table: The table.
        numeric: Headings of all columns that will be asked for as numbers; decimal marks are decided by them.
    """

    def __init__(self, table: Table, numeric: list[str]):
        self.table = table
        self.decimal = decimal_of(table, [self.index(heading) for heading in numeric])

    def index(self, heading: str) -> int:
        """Place of a column.

        Raises:
            FileError: There is none of that heading.
        """
        if heading not in self.table.headings:
            raise FileError(
                f"this layout needs a column '{heading}'",
                path=self.table.source,
                line=self.table.heading_line,
            )
        return self.table.headings.index(heading)

    def numbers(self, headings: list[str], unit: str, quantity: Quantity) -> list[np.ndarray]:
        """One array (rows,) a column, in SI."""
        return [
            to_si(to_numbers(self.table, self.index(heading), self.decimal), unit, quantity)
            for heading in headings
        ]

    def text(self, heading: str) -> tuple[str, ...]:
        """Cells of a column as they stand."""
        return self.table.columns[self.index(heading)]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided about the table's text."""
        return self.table.notes + (("decimal commas",) if self.decimal is Decimal.COMMA else ())
