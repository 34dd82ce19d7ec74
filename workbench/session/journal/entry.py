"""One line of the journal: a command and its outcome."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from workbench.session.command import AbstractCommand


class Ending(StrEnum):
    """Outcome of a command."""

    DONE = "done"
    REFUSED = "refused"
    CANCELLED = "cancelled"
    FAILED = "failed"


@dataclass(frozen=True, eq=False)
class Entry:
    """One line of the journal.

    Args:
        command: What was asked for.
        ending: What became of it.
        basis: Number of entries that its computation knew of.
        time: When it ended by the wall clock [s since 1970], which may jump.
        seconds: How long it took [s].
        text: Its message, if any.
        at: When it ended, in seconds of the session: a clock that never goes back [s].
        result: What was computed, if the journal keeps it.
    """

    command: AbstractCommand
    ending: Ending
    basis: int
    time: float
    seconds: float
    text: str = ""
    at: float = 0.0
    result: Any = None
