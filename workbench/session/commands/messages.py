"""Messages, shown by the program and dismissed by the user; and the open tab."""

from enum import StrEnum

from workbench.session.command import AbstractChange, computed
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Session


class Tell(AbstractChange):
    """Show a message about a problem outside the worker (such as a file that is too large)."""

    title = "Message"

    text: str
    severity: Severity = Severity.ERROR

    def apply(self, session: Session) -> Session:
        return session.with_message(self.severity, self.text)


class Dismiss(AbstractChange):
    """Dismiss the messages."""

    title = "Dismiss the messages"
    key = "dismiss"

    def apply(self, session: Session) -> Session:
        return session.updated("page", messages=())


class SetCaption(AbstractChange):
    """What the demo says, at last too; an empty text takes it away."""

    title = "Caption"

    text: str
    is_last: bool = False

    def apply(self, session: Session) -> Session:
        return session.updated("page", caption=self.text, is_paused=False, is_over=self.is_last)


class Steer(StrEnum):
    """Controls of a demo besides stopping it."""

    PAUSE = "Pause"
    ON = "Go on"


class SteerDemo(AbstractChange):
    """Pause or continue the demo."""

    how: Steer

    title = computed(lambda self: f"{self.how} (demo)")

    def apply(self, session: Session) -> Session:
        return session.updated("page", is_paused=self.how is Steer.PAUSE)


class OpenTab(AbstractChange):
    """Open a tab on all pages, though another one may have been chosen there by hand."""

    key = "tab"
    is_automatic = True

    tab: Tab

    title = computed(lambda self: f"Open {self.tab}")

    def apply(self, session: Session) -> Session:
        return session.updated("page", opened=session.page.opened + 1, tab=self.tab)


class NoteTab(AbstractChange):
    """A page tells which of its tabs is open: what is advised is about that one."""

    key = "seen tab"
    is_automatic, is_kept = True, False

    tab: Tab

    title = computed(lambda self: f"{self.tab} is open")

    def apply(self, session: Session) -> Session:
        return session.updated("page", tab=self.tab)
