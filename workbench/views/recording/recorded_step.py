"""What a recorder is told: a step of the session."""

from dataclasses import dataclass

from workbench.session.journal.entry import Entry
from workbench.session.state import Session


@dataclass(frozen=True, eq=False)
class Moment:
    """A step of the session.

    Args:
        step: Number of its command; 0 is the beginning.
        at: Time of the session [s].
        session: Snapshot after the command.
        entry: The command; None in the beginning.
    """

    step: int
    at: float
    session: Session
    entry: Entry | None = None

    @property
    def is_passing(self) -> bool:
        """Whether a newer command of the same kind makes it unimportant, as in the middle of a drag."""
        return self.entry is not None and self.entry.command.key is not None

    def replaces(self, other: "Moment") -> bool:
        """Whether it makes the other one unimportant: both pass, and are the same command to the queue."""
        if self.entry is None or other.entry is None or not self.is_passing:
            return False
        return self.entry.command.key == other.entry.command.key
