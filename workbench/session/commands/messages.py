"""Messages: told by the program, put away by the user."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

from workbench.session.command import AbstractChange
from workbench.session.state import Session, Severity


@dataclass(frozen=True)
class Tell(AbstractChange):
    """Show a message, for what goes wrong outside the worker (a file that is too large)."""

    text: str
    severity: Severity = Severity.ERROR

    @property
    def title(self) -> str:
        return "Message"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        """Any text will do."""

    def apply(self, session: Session) -> Session:
        return session.tell(self.severity, self.text)


@dataclass(frozen=True)
class Dismiss(AbstractChange):
    """Put the messages away."""

    @property
    def title(self) -> str:
        return "Put messages away"

    @property
    def key(self) -> Hashable | None:
        return "dismiss"

    def check(self, session: Session) -> None:
        """Nothing can be wrong."""

    def apply(self, session: Session) -> Session:
        return replace(session, messages=())


@dataclass(frozen=True)
class SetCaption(AbstractChange):
    """What the demo says; an empty text takes it away."""

    text: str

    @property
    def title(self) -> str:
        return "Caption"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        """Any text will do."""

    def apply(self, session: Session) -> Session:
        return replace(session, caption=self.text)
