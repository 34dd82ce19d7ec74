"""A view: anything that draws snapshots of the session (the browser, a recording, a test)."""

from abc import ABC, abstractmethod

from workbench.session.state import Session


class AbstractView(ABC):
    """Draws snapshots; called from the worker's thread only, one at a time, the newest last."""

    @abstractmethod
    def draw(self, session: Session) -> None:
        """Show this snapshot. What did not change since the last one is the same object."""

    @abstractmethod
    def close(self) -> None:
        """Stop showing; nothing is drawn afterwards."""
