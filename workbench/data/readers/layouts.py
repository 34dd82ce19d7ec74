"""Layouts: files of known origin whose columns need more than names and units to be interpreted."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from workbench.data.readers.columns_option import IGNORED, Naming
from workbench.data.readers.fields import Fields, fields_of
from workbench.data.readers.file_kind import TABLE_ENDINGS
from workbench.data.readers.table import Table
from workbench.parts import parts

PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""


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

    def arrays(self, path: Path) -> dict[str, np.ndarray]:
        """Its arrays by name, rows first; none where it isn't of arrays."""
        return {}


def named(table: Table, names: Mapping[str, str], *notes: str) -> Fields:
    """The columns that are said to be something, in SI; the others are left out.

    Args:
        names: What columns are by their exact headings, such as `{"x_t": "x[mm]"}`; all must be there.
        notes: Decisions of the layout.
    """
    if missing := [heading for heading in names if heading not in table.headings]:
        raise table.error(f"this layout needs a column '{missing[0]}'")
    ours = tuple(names.get(heading, IGNORED) for heading in table.headings)
    fields = fields_of(replace(table, names=ours))
    return replace(fields, notes=(*table.notes, *notes))


def layouts() -> tuple[list[AbstractTableLayout], list[AbstractFileLayout]]:
    """Layouts of tables, and of whole files and folders, each in the order in which they are tried."""
    every = parts("layouts", (AbstractTableLayout, AbstractFileLayout))
    tables = [known for known in every if isinstance(known, AbstractTableLayout)]
    return tables, [known for known in every if isinstance(known, AbstractFileLayout)]


def layout_names() -> tuple[str, ...]:
    """What may be asked for by name."""
    return (PLAIN, *(known.name for known in parts("layouts", (AbstractTableLayout, AbstractFileLayout))))


def file_endings() -> tuple[str, ...]:
    """Of the names of all files that are read, in lower case."""
    return tuple(dict.fromkeys([*TABLE_ENDINGS, *(e for known in layouts()[1] for e in known.endings)]))
