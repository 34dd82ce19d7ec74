"""A view: anything that draws snapshots of the session (the browser, a recording, a test); a keeper, which is
told of every command, its outcome, and the session afterwards."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from workbench.session.command import AbstractCommand
from workbench.session.page_state import Severity
from workbench.session.state import Session


class AbstractView(ABC):
    """Draws snapshots; called from the worker's thread only, one at a time, the newest last."""

    is_behind: bool = False
    """Whether something of the last snapshot was put off: it is drawn again once no command comes."""

    @abstractmethod
    def draw(self, session: Session) -> None:
        """Show this snapshot. What did not change since the last one is the same object."""

    @abstractmethod
    def close(self) -> None:
        """Stop showing; nothing is drawn afterwards."""


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


@dataclass(frozen=True, eq=False)
class Moment:
    """A step of the session.

    Args:
        step: Number of its command; 0 is the beginning.
        at: Time of the session [s].
        session: Snapshot after the command.
        entry: The command; None in the beginning.
    """

    step: int
    at: float
    session: Session
    entry: Entry | None = None

    @property
    def is_passing(self) -> bool:
        """Whether a newer command of the same kind makes it unimportant, as in the middle of a drag."""
        return self.entry is not None and self.entry.command.key is not None

    def replaces(self, other: "Moment") -> bool:
        """Whether it makes the other one unimportant: both pass, and are the same command to the queue."""
        if self.entry is None or other.entry is None or not self.is_passing:
            return False
        return self.entry.command.key == other.entry.command.key


Notify = Callable[[Severity, str], None]
"""Tells the user something, from any thread."""


class AbstractKeeper(ABC):
    """Notified of every command by the worker's thread; must be quick and never raise."""

    @abstractmethod
    def begin(self, session: Session, *, step: int, at: float, notify: Notify) -> None:
        """Before the first command.

        Args:
            session: As it stands.
            step: Number of commands before, if the session goes on from an older one.
            at: Time of the session by then [s].
            notify: For trouble that the user should know of.
        """

    @abstractmethod
    def note(self, step: int, entry: Entry, session: Session) -> None:
        """A command has ended; this is the session afterwards.

        Args:
            step: Number of the command, counted from 1; the last one again where this stands for both.
            entry: The command and what became of it.
            session: Snapshot after it.
        """

    @abstractmethod
    def close(self) -> None:
        """The session ends; nothing is noted afterwards."""
