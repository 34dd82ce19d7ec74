"""Display of results: the same small tables in a terminal and in a notebook.

A result says what it shows as `rich` renderables (`summary`); here they become text and HTML. A result that
others compute with leaves that to its report, which registers a function for its class.
"""

import io
from abc import ABC, abstractmethod
from functools import singledispatch
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from workbench.base.errors import OptionError
from workbench.base.wording import readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 100
"""Columns of a result that is printed."""


@singledispatch
def summary_of(result: Any) -> RenderableType:
    """The key results for display; the report of each kind of result registers its own."""
    return Text(f"<{type(result).__name__}>")


@singledispatch
def plot_of(result: Any, name: str = "") -> "Figure":
    """A figure of a result, likewise; where there are several, one by its name."""
    raise OptionError(f"there is no figure of a {type(result).__name__}")


class AbstractShown(ABC):
    """A result that prints as small tables, in a terminal as in a notebook; some have a figure as `plot`."""

    @abstractmethod
    def summary(self) -> RenderableType:
        """The key results, for display."""

    def __repr__(self) -> str:
        return as_text(self.summary())

    def _repr_html_(self) -> str:
        return as_html(self.summary())


class AbstractReported(AbstractShown):
    """A result that a report shows, which imports it: see `summary_of`."""

    def summary(self) -> RenderableType:
        return summary_of(self)


class AbstractPlotted(AbstractReported):
    """One of which there is a figure, too: see `plot_of`."""

    def plot(self, name: str = "") -> "Figure":
        return plot_of(self, *filter(None, [name]))


def as_text(renderable: RenderableType) -> str:
    """Tables and lines as plain text."""
    console = Console(file=io.StringIO(), width=WIDTH, color_system=None, force_jupyter=False)
    console.print(renderable)
    lines = readable(console.file.getvalue()).split("\n")  # type: ignore[attr-defined]
    return "\n".join(line.rstrip() for line in lines).strip("\n")


def as_html(renderable: RenderableType) -> str:
    if isinstance(renderable, Group):
        return "".join(as_html(part) for part in renderable.renderables)
    if isinstance(renderable, Table):
        return _table(renderable)
    text = renderable if isinstance(renderable, Text) else Text.from_markup(str(renderable))
    return Markup('<p style="margin: 0.3em 0">{}</p>').format(_inline(text))


def _table(table: Table) -> str:
    """A table with its title and headings; numbers stay on the right."""
    sides = [
        f"padding: 0.1em 0.6em; text-align: {'left' if column.justify == 'default' else column.justify}"
        for column in table.columns
    ]
    head = _row("th", [column.header for column in table.columns], sides)
    cells = zip(*(column.cells for column in table.columns), strict=True)
    body = Markup("").join(_row("td", list(row), sides) for row in cells)
    title = (
        Markup('<caption style="text-align: left">{}</caption>').format(_inline(table.title))
        if table.title
        else ""
    )
    return Markup("<table>{}<thead>{}</thead><tbody>{}</tbody></table>").format(title, head, body)


def _row(tag: str, cells: list, sides: list[str]) -> Markup:
    row = Markup("").join(
        Markup('<{0} style="{1}">{2}</{0}>').format(Markup(tag), side, _inline(cell))
        for cell, side in zip(cells, sides, strict=True)
    )
    return Markup("<tr>{}</tr>").format(row)


def _inline(cell) -> Markup:
    """Text of a cell, its line breaks kept."""
    text = cell if isinstance(cell, Text) else Text.from_markup(str(cell))
    lines = Markup("<br>").join(escape(readable(line)) for line in text.plain.split("\n"))
    return Markup("<b>{}</b>").format(lines) if "bold" in str(text.style) else lines
