"""A result as one list of blocks, built once: terminal, page, notebook, file and recording show the same.

    def blocks(result):
        yield Sentence("ARIA: 48 rows fitted, 12 held out", tone=Tone.STRONG)
        yield ResultTable("", ("model", "mean\\n[mm]"), [("nominal", "4.112"), ("calibrated", "0.268")])
        yield Sentence("base as given", "note")

    as_text(blocks(result)), as_html(blocks(result)), as_markdown(blocks(result))   # result_display.py

A chart (`chart.py`) is a block, too; terminals and recordings leave it out, as its numbers stand in tables.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from workbench.base.advice import ask, failures
from workbench.report.chart import Bars, Chart

R = TypeVar("R")


class Tone(StrEnum):
    """How a sentence is meant; the value is its style in a terminal."""

    PLAIN = "none"
    STRONG = "bold"
    QUIET = "dim"
    GOOD = "bold green"
    CAREFUL = "bold yellow"
    BAD = "bold red"


@dataclass(frozen=True)
class Sentence:
    """A sentence.

    Args:
        kind: What kind of remark it is, such as `note` or `warning`; stands before it.
    """

    text: str
    kind: str = ""
    tone: Tone = Tone.PLAIN

    @property
    def is_warning(self) -> bool:
        return self.kind in ("warning", "not identifiable")


@dataclass(frozen=True)
class ResultTable:
    """Rows of cells, as people read them.

    Args:
        headings: Of the columns; a unit may stand on a line of its own.
        words: How many columns, from the first on, have words on the left; the others have numbers on the
            right, which are never broken.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1


Block = Sentence | ResultTable | Chart | Bars


def lines(kind: str, texts: Iterable[str]) -> list[Block]:
    """Remarks of one kind."""
    return [Sentence(text, kind) for text in texts]


def headed(sentence: str, *blocks: Block, notes: Iterable[str] = ()) -> list[Block]:
    """A result: its sentence, tables and lines, and notes at the end."""
    return [Sentence(sentence, tone=Tone.STRONG), *blocks, *lines("note", notes)]


def assembled(result: R, *parts: Callable[[R], Iterable[Block]]) -> list[Block]:
    """The blocks of a result, part by part; a part that fails costs a warning instead of the result."""

    def shown(part: Callable[[R], Iterable[Block]]) -> list[Block]:
        name = part.__name__.replace("_", " ")
        return ask(f"what is shown of {name}", lambda: list(part(result)), [])

    with failures() as failed:
        blocks = [block for part in parts for block in shown(part)]
    return [*blocks, *lines("warning", failed)]
