"""What an extra adds to the session."""

from enum import Enum, auto
from typing import TYPE_CHECKING, ClassVar, TypeVar

if TYPE_CHECKING:
    from workbench.session.next_step import NextStep
    from workbench.session.state import Session


class GoesWith(Enum):
    """What a part is of, and is dropped with."""

    PLATE = auto()
    MEASUREMENTS = auto()
    PAGE = auto()


class AbstractPart:
    """What an extra keeps in the session: a frozen record, one of its type."""

    goes_with: ClassVar[GoesWith] = GoesWith.PLATE
    """That of the measurements stays on another plate, that of the page with another arm, too."""
    is_mode: ClassVar[bool] = False
    """Whether the page is its own until it ends: panels without a tab stand in place of the tabs."""

    def step(self, session: "Session") -> "NextStep | None":
        """The next step while it stands; None: as without it. That of a mode goes first."""
        return None


Part = TypeVar("Part", bound=AbstractPart)
