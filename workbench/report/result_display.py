"""Renderers of blocks: a terminal, HTML for notebooks, files and the page, and markdown for recordings."""

import io
from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from functools import singledispatch
from typing import Any

from markupsafe import Markup, escape
from rich.console import Console, Group
from rich.table import Column, Table, box
from rich.text import Text

from workbench.base.wording import readable
from workbench.report.blocks import Block, ResultTable, Sentence, Tone
from workbench.report.colours import BAD, CAREFUL, GOOD

WIDTH = 100
"""Columns of a result that is printed."""
WIDE = 7
"""Columns of a table from which on they stand closer together, for 80 characters."""
INKS = {
    Tone.PLAIN: "",
    Tone.STRONG: "font-weight: 600",
    Tone.QUIET: "opacity: .7",
    Tone.GOOD: f"font-weight: 600; color: {GOOD}",
    Tone.CAREFUL: f"font-weight: 600; color: {CAREFUL}",
    Tone.BAD: f"font-weight: 600; color: {BAD}",
}


@singledispatch
def blocks_of(result: Any) -> Iterable[Block]:
    """The blocks of a result; the report of each kind of result registers its own."""
    return [Sentence(f"<{type(result).__name__}>")]


class AbstractShown(ABC):
    """A result that prints as small tables, in a terminal as in a notebook, there with its charts."""

    @abstractmethod
    def blocks(self) -> Iterable[Block]:
        """The result, for all that shows it."""

    def __repr__(self) -> str:
        return as_text(self.blocks())

    def _repr_html_(self) -> str:
        return as_html(self.blocks())


class AbstractReported(AbstractShown):
    """A result that a report shows, which imports it: see `blocks_of`."""

    def blocks(self) -> Iterable[Block]:
        return blocks_of(self)


def as_rich(blocks: Iterable[Block]) -> Group:
    """For a terminal."""
    return Group(*(_rich(block) for block in blocks if isinstance(block, Sentence | ResultTable)))


def as_text(blocks: Iterable[Block], width: int = WIDTH) -> str:
    """Plain text for a terminal of any kind."""
    console = Console(file=io.StringIO(), width=width, color_system=None, force_jupyter=False)
    console.print(as_rich(blocks))
    lines = console.file.getvalue().split("\n")  # type: ignore[attr-defined]
    return "\n".join(line.rstrip() for line in lines).strip("\n")


def as_html(blocks: Iterable[Block]) -> str:
    """HTML that needs no style sheet, and takes the colours of the page that it stands in."""
    return str(Markup("").join(_html(block) for block in blocks))  # what is put before it stays markup


def as_markdown(blocks: Iterable[Block]) -> str:
    return readable(
        "\n\n".join(_markdown(block) for block in blocks if isinstance(block, Sentence | ResultTable))
    )


def _rich(block: Sentence | ResultTable) -> Table | Text:
    if isinstance(block, Sentence):
        before = (f"{block.kind}: ", "yellow" if block.is_warning else "dim") if block.kind else ""
        return Text.assemble(before, (readable(block.text), block.tone.value))
    columns = [
        Column(Text(readable(heading)), overflow="fold" if k else "ellipsis")
        if k < block.words
        else Column(Text(readable(heading)), justify="right", no_wrap=True)
        for k, heading in enumerate(block.headings)
    ]
    title = Text(readable(block.title)) if block.title else None
    padding = (0, 1, 0, 0) if len(columns) > WIDE else (0, 1)
    made = Table(
        *columns, box=box.SIMPLE_HEAD, pad_edge=False, padding=padding, title=title, title_justify="left"
    )
    for row in block.rows:
        made.add_row(*(Text(readable(cell)) for cell in row))
    return made


def _html(block: Block) -> Markup:
    if isinstance(block, Sentence):
        text = f"{block.kind}: {block.text}" if block.kind else block.text
        ink = INKS[Tone.CAREFUL if block.is_warning else block.tone]
        return Markup('<p style="margin: .3em 0; {}">{}</p>').format(ink, _broken(text))
    if isinstance(block, ResultTable):
        return _table(block)
    drawn = Markup('<figure style="margin: .8em 0; max-width: 30em">{}{}</figure>')
    title = Markup("<figcaption>{}</figcaption>").format(readable(block.title)) if block.title else ""
    svg = readable(block.svg())
    return drawn.format(title, Markup(svg)) if svg else Markup("")


def _table(block: ResultTable) -> Markup:
    def row(tag: str, cells: Sequence[str]) -> Markup:
        made = Markup('<{0} style="padding: .1em .6em .1em 0; text-align: {1}">{2}</{0}>')
        sides = [
            "left; min-width: 3em" if k < block.words else "right; white-space: nowrap"
            for k in range(len(cells))
        ]
        parts = (made.format(tag, side, _broken(c)) for side, c in zip(sides, cells, strict=True))
        return Markup("<tr>{}</tr>").format(Markup("").join(parts))

    title = Markup('<caption style="text-align: left">{}</caption>').format(readable(block.title))
    body = Markup("").join(row("td", cells) for cells in block.rows)
    return Markup(
        '<div style="overflow-x: auto"><table style="border-collapse: collapse; '
        'font-variant-numeric: tabular-nums">{}<thead>{}</thead><tbody>{}</tbody></table></div>'
    ).format(title if block.title else "", row("th", block.headings), body)


def _broken(text: str) -> Markup:
    """Text with its line breaks."""
    return Markup("<br>").join(escape(readable(line)) for line in text.split("\n"))


def _markdown(block: Sentence | ResultTable) -> str:
    if isinstance(block, Sentence):
        return f"- {block.kind}: {block.text}" if block.kind else block.text
    cells = (block.headings, *block.rows)
    rows = [[cell.replace("\n", " ").replace("|", "\\|") for cell in row] for row in cells]
    rows.insert(1, ["---" if k < block.words else "---:" for k in range(len(block.headings))])
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    return f"**{block.title}**\n\n{table}" if block.title else table
