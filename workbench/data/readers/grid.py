"""What every file becomes first: rows of cells as text, each with its place in the file."""

from dataclasses import dataclass
from enum import StrEnum


class Separator(StrEnum):
    """What stands between two fields of a text file."""

    TAB = "\t"
    SEMICOLON = ";"
    COMMA = ","
    BLANKS = " "

    @property
    def words(self) -> str:
        """The separator, as people say it."""
        return {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}[self.value]


@dataclass(frozen=True, eq=False, kw_only=True)
class Grid:
    """Cells as they stand in the file.

    Args:
        source: Path of the file, for messages.
        rows: Cells of each row, stripped; rows may differ in length.
        lines: Line (or spreadsheet row) of each row, counted from 1.
        separator: What parts the fields; None where the format itself does (xlsx, parquet, mat).
        comments: Comment lines before the first row, without their '#'.
        notes: Decisions taken so far.
    """

    source: str
    rows: list[list[str]]
    lines: list[int]
    separator: Separator | None = None
    comments: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
