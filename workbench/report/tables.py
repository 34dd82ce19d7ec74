"""Tables and lines for the terminal, in one look."""

from collections.abc import Iterable

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Column, Table, box
from rich.text import Text


def new_table(title: str, *columns: str | Column) -> Table:
    """An empty table: the first column's words on the left, numbers on the right, or columns as they are."""
    made = [
        column
        if isinstance(column, Column)
        else Column(escape(column), justify="right" if number else "left", no_wrap=bool(number))
        for number, column in enumerate(columns)
    ]
    return Table(*made, box=box.SIMPLE_HEAD, pad_edge=False, title=escape(title), title_justify="left")


def folded(heading: str) -> Column:
    """A column of words on the left, which are broken where they are too long."""
    return Column(escape(heading), overflow="fold")


def unbroken(heading: str) -> Column:
    """A column of words on the left that are never broken."""
    return Column(escape(heading), no_wrap=True)


def headed(sentence: str, *parts: RenderableType, notes: Iterable[str] = ()) -> Group:
    """A result: its sentence, tables and lines, and notes at the end."""
    return Group(Text(sentence, style="bold"), *parts, *(line("note", text) for text in notes))


def line(kind: str, text: str) -> Text:
    """One line of the answer with its kind before it."""
    style = {"warning": "yellow", "not identifiable": "yellow"}.get(kind, "dim")
    return Text.assemble((f"{kind}: ", style), text)
