"""What a part of the scene is."""

from abc import ABC, abstractmethod

from workbench.session.state import Session


class AbstractPart(ABC):
    """Something in the scene. Its gestures only send commands; `show` draws what has changed."""

    @abstractmethod
    def show(self, session: Session) -> None:
        """Draw this snapshot."""
