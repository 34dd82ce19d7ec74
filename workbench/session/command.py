"""What a command is: a frozen record that can be checked, carried out, written down, and done again."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from typing import Any

from workbench.session.state import Session

Progress = Callable[[float, str], None]
Cancel = Callable[[], bool]


class AbstractCommand(ABC):
    """Something that a user asks for. Implementations are frozen dataclasses of plain values."""

    @property
    @abstractmethod
    def title(self) -> str:
        """What it does, in words for the journal and for messages."""

    @property
    @abstractmethod
    def key(self) -> Hashable | None:
        """Commands waiting in the queue under the same key are replaced by the newest; None: never."""

    @abstractmethod
    def check(self, session: Session) -> None:
        """Raise a `WorkbenchError` if it makes no sense here."""


class AbstractChange(AbstractCommand):
    """A quick command, carried out by the worker itself."""

    @abstractmethod
    def apply(self, session: Session) -> Session:
        """The session afterwards."""


class AbstractTask(AbstractCommand):
    """A long command, computed beside the worker from the session at its start.

    Other commands go on meanwhile; what was computed is put into the session as it is at the end.
    """

    @abstractmethod
    def compute(self, session: Session, *, progress: Progress, cancel: Cancel) -> Any:
        """The long part.

        Raises:
            Cancelled: `cancel` said so.
        """

    @abstractmethod
    def finish(self, session: Session, result: Any) -> Session:
        """The present session with the result."""


class AbstractChore(AbstractTask):
    """A computation that the session itself asks for, so that no change has to wait for it.

    Chores run beside tasks, one at a time, and are cancelled when the session no longer needs them.
    """

    @classmethod
    @abstractmethod
    def needed(cls, session: Session) -> "AbstractChore | None":
        """The chore that this session needs; None if none. Equal chores compute the same."""


class Cancelled(Exception):
    """A task stopped because it was asked to."""
