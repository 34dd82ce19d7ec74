"""The known layouts, all from extras and other packages."""

from workbench.data.readers.file_kind import TABLE_ENDINGS
from workbench.data.readers.layouts.layout import AbstractFileLayout, AbstractTableLayout
from workbench.parts import parts

PLAIN = "plain"
"""The layout of formats.md, for tables that would else be taken for one of the others."""


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
    more = (ending for known in layouts()[1] for ending in known.endings)
    return tuple(dict.fromkeys((*TABLE_ENDINGS, *more)))
