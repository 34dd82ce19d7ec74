"""The command that opens a tab of the page."""

from dataclasses import dataclass, replace

from workbench.session.command import AbstractChange
from workbench.session.state import Opened, Session, Tab


@dataclass(frozen=True)
class OpenTab(AbstractChange):
    """Open a tab on all pages, though another one may have been chosen there by hand."""

    key = "tab"
    is_automatic = True

    tab: Tab

    @property
    def title(self) -> str:
        return f"Open {self.tab}"

    def apply(self, session: Session) -> Session:
        return replace(session, opened=Opened(self.tab))
