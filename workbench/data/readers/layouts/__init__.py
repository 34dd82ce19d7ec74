"""The known layouts, all from other packages and extras: entry points of `workbench.layouts`."""

from workbench.base.registry import Registry
from workbench.data.readers.file_kind import TABLE_ENDINGS
from workbench.data.readers.layouts.layout import AbstractFileLayout, AbstractTableLayout

PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""
LAYOUTS: Registry[AbstractTableLayout | AbstractFileLayout] = Registry(
    "layout", (AbstractTableLayout, AbstractFileLayout), group="workbench.layouts"
)
"""Layouts of tables and of whole files, in the order in which they are tried."""


def file_endings() -> tuple[str, ...]:
    """Of the names of all files that are read, in lower case."""
    return tuple(dict.fromkeys((*TABLE_ENDINGS, *(end for known in file_layouts() for end in known.endings))))


def table_layouts() -> list[AbstractTableLayout]:
    return [known for known in LAYOUTS.values() if isinstance(known, AbstractTableLayout)]


def file_layouts() -> list[AbstractFileLayout]:
    """Those of files and folders."""
    return [known for known in LAYOUTS.values() if isinstance(known, AbstractFileLayout)]
