"""The command that opens a tab of the page."""

from dataclasses import replace

from workbench.session.command import AbstractChange, computed
from workbench.session.state import Opened, Session, Tab


class OpenTab(AbstractChange):
    """Open a tab on all pages, though another one may have been chosen there by hand."""

    key = "tab"
    is_automatic = True

    tab: Tab

    title = computed(lambda self: f"Open {self.tab}")

    def apply(self, session: Session) -> Session:
        return replace(session, opened=Opened(self.tab))
