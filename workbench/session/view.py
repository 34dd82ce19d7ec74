"""A view: anything that draws snapshots of the session (the browser, a recording, a test)."""

from abc import ABC, abstractmethod
from collections.abc import Callable

from workbench.session.journal.entry import Entry
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
