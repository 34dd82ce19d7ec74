"""What an extra adds to the session."""

from typing import TYPE_CHECKING, ClassVar, TypeVar

if TYPE_CHECKING:
    from workbench.session.next_step import NextStep


class AbstractPart:
    """What an extra keeps in the session: a frozen record, one of its type."""

    is_of_measurements: ClassVar[bool] = False
    """Whether it goes with the measurements, and stays on another plate; else it goes with the plate."""
    conclusion: ClassVar[str] = ""
    """What the session has come to by it, though nothing of the arm is identified; empty for nothing."""
    is_mode: ClassVar[bool] = False
    """Whether the page is its own until it ends: panels without a tab stand in place of the tabs."""

    def step(self) -> "NextStep | None":
        """The next step while it stands; None: as without it."""
        return None


Part = TypeVar("Part", bound=AbstractPart)
