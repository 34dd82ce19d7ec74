"""Tables and lines for the terminal, in one look."""

from rich.markup import escape
from rich.table import Table, box
from rich.text import Text


def new_table(title: str, *columns: str) -> Table:
    """An empty table: the first column's words on the left, numbers on the right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=escape(title), title_justify="left")
    for number, column in enumerate(columns):
        table.add_column(escape(column), justify="right" if number else "left", no_wrap=bool(number))
    return table


def line(kind: str, words: str) -> Text:
    """One line of the answer with its kind before it."""
    style = {"warning": "yellow", "not identifiable": "yellow"}.get(kind, "dim")
    return Text.assemble((f"{kind}: ", style), words)
