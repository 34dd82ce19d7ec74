"""The known layouts, all from extras and other packages."""

from workbench.data.readers.file_kind import TABLE_ENDINGS
from workbench.data.readers.layouts.layout import AbstractFileLayout, AbstractTableLayout
from workbench.parts import parts

PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""


def file_endings() -> tuple[str, ...]:
    """Of the names of all files that are read, in lower case."""
    return tuple(dict.fromkeys((*TABLE_ENDINGS, *(end for known in file_layouts() for end in known.endings))))


def layouts() -> tuple[AbstractTableLayout | AbstractFileLayout, ...]:
    """Layouts of tables and of whole files, in the order in which they are tried."""
    return parts("layouts", (AbstractTableLayout, AbstractFileLayout))


def layout_names() -> tuple[str, ...]:
    """What may be asked for by name."""
    return (PLAIN, *(known.name for known in layouts()))


def table_layouts() -> list[AbstractTableLayout]:
    return [known for known in layouts() if isinstance(known, AbstractTableLayout)]


def file_layouts() -> list[AbstractFileLayout]:
    """Those of files and folders."""
    return [known for known in layouts() if isinstance(known, AbstractFileLayout)]
