"""What a recorder is told: a step of the session, and which of those that pass quickly it draws."""

import math
from dataclasses import dataclass

from workbench.session.journal.entry import Entry
from workbench.session.state import Session

INTERVAL = 0.1
"""Minimum time between two pictures in the middle of a drag, in the beginning [s]."""
OFTEN = 1000
"""Pictures of drags after which the time between them doubles."""


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


class DrawingPace:
    """How often what is passing is drawn: less often the longer a session becomes, so that it stays small."""

    def __init__(self) -> None:
        self._passing, self._last = 0, -math.inf

    def note(self, moment: Moment, now: float) -> None:
        """A moment was drawn at this time [s]."""
        self._passing += moment.is_passing
        self._last = now

    def wait(self, now: float) -> float:
        """How long the next picture of what is passing has to wait [s]; not positive if it need not."""
        return self._last + INTERVAL * 2.0 ** (self._passing // OFTEN) - now
