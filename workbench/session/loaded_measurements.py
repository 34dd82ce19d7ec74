"""Measurements of a session, and how they were interpreted."""

import re
from dataclasses import dataclass
from functools import cached_property

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.readers.column_meanings import TableColumn
from workbench.data.readers.read import Preview
from workbench.identification.checks.arm_match import ArmMatch
from workbench.identification.rows.row_selection import AbstractSplit

ROW = r"\d+(?:[–-]\d+)?(?: \([^()]*\))?"
ROWS = re.compile(rf"(?<=\brow )\d+|(?<=\brows ){ROW}(?:(?:, | and ){ROW})*")
"""Numbers of rows in a sentence, as in `row 22` and `rows 3, 17 (off by 2 mm)`."""


@dataclass(frozen=True, eq=False)
class MeasurementFile:
    """A file and the interpretation of its columns, whether or not it could be read that way.

    Args:
        name: Its name.
        content: Its bytes.
        preview: What was understood.
        columns: What its columns were said to be; empty: as its headings say.
        match: Which arm its rows are of, where they have another number of joints than the session's.
    """

    name: str
    content: bytes
    preview: Preview
    columns: str = ""
    match: ArmMatch | None = None

    @property
    def is_plain(self) -> bool:
        """Whether its columns can be said to be something else."""
        return bool(self.preview.columns) and self.preview.layout == "plain"


@dataclass(frozen=True, eq=False)
class Loaded:
    """Measurements, and how they were interpreted.

    Args:
        dataset: The rows.
        name: File name, or how they came to be.
        facts: Pairs of a heading and what was understood.
        notes: Decisions that the reader took, one sentence each.
        virtual: Whether a virtual arm made them.
        checks: Rows that are measured for checking only and never fitted.
        actual: The virtual arm that was measured, hidden from every computation.
        read: The rows as they were read, before anything was said of them for an arm; None: virtual ones.
        match: How well they and the arm go together; None: not asked.
        file: Where they were read; None: virtual ones.
    """

    dataset: Dataset
    name: str
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    virtual: bool = False
    checks: Dataset | None = None
    actual: Robot | None = None
    read: Dataset | None = None
    match: ArmMatch | None = None
    file: MeasurementFile | None = None

    @property
    def is_foreign(self) -> bool:
        """Whether these are clearly another arm's rows."""
        return self.match is not None and self.match.is_foreign

    @cached_property
    def counter(self) -> TableColumn | None:
        """A column that counts the rows, and says nothing else but the name of a point."""
        columns = () if self.file is None else self.file.preview.columns
        return next((c for c in columns if c.key in (None, "point") and numbers_of(c.cells)), None)

    @cached_property
    def numbers(self) -> list[int]:
        """The file's own, by row; empty where it doesn't count them."""
        return [] if self.counter is None else numbers_of(self.counter.cells)

    def row_name(self, row: int) -> str:
        """As the file has it: `P17`, `Nr 17`; its number from 0 where the file doesn't count its rows."""
        if self.counter is None or row >= len(self.numbers):
            return f"{row}"
        cell = self.counter.cells[row]
        return f"{self.counter.heading or 'no.'} {self.numbers[row]}" if cell.isdecimal() else cell

    def named(self, sentence: str) -> str:
        """A sentence with rows as the file has them."""
        one = lambda at: at[0] if at[0][0] == "(" else self.row_name(int(at[0]))  # noqa: E731
        plain = sentence if self.counter is None else sentence.replace(f" ({self.dataset.counted})", "")
        return ROWS.sub(lambda rows: re.sub(r"\([^()]*\)|\d+", one, rows[0]), plain)


def numbers_of(cells: tuple[str, ...]) -> list[int]:
    """Of cells that count rows, alone or behind one and the same word, as P1, P2 …; empty if these don't."""
    found = [match for cell in cells if (match := re.fullmatch(r"(\D*)(\d{1,9})", cell, re.ASCII))]
    own = [int(match[2]) for match in found]
    counts = len(own) == len(cells) and len({match[1] for match in found}) == 1 and own == sorted({*own})
    return own if counts else []


BY_HAND = "excluded manually"
"""The reason why a row is kept out that a user keeps out."""


def is_of_other_rows(found: AbstractSplit | None, left_out: frozenset[int]) -> bool:
    """Whether a result was found with other rows kept out by hand than these."""
    rows = {} if found is None else dict(found.excluded)
    is_back = any(why == BY_HAND and row not in left_out for row, why in rows.items())
    return found is not None and (is_back or not left_out <= rows.keys())


OBSERVATIONS = "position", "rotation", "markers", "distance", "contact", "tilt"


def facts_of(dataset: Dataset) -> tuple[tuple[str, str], ...]:
    """Pairs of a heading and what was understood."""
    kept_out = int((~dataset.included).sum())
    facts = [
        ("Rows", f"{len(dataset)}" + (f", {kept_out} of them excluded" if kept_out else "")),
        ("Joints", f"{dataset.joints}"),
        ("Measured", ", ".join(n for n in OBSERVATIONS if getattr(dataset, n) is not None) or "nothing"),
    ]
    if len(dataset.sessions) > 1:
        facts.append(("Sessions", ", ".join(dataset.sessions)))
    return tuple(facts)
