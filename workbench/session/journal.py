"""The journal: every command with what became of it, enough to come to the same session again.

A task is computed from the session at its start and put into the session at its end, with other commands
in between. Its entry says how many entries there were at its start, so that a replay does the same.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from workbench.session.command import AbstractChange, AbstractCommand, AbstractTask
from workbench.session.state import Session


class Ending(StrEnum):
    """What became of a command."""

    DONE = "done"
    REFUSED = "refused"
    CANCELLED = "cancelled"
    FAILED = "failed"


@dataclass(frozen=True, eq=False)
class Entry:
    """One line of the journal.

    Args:
        command: What was asked for.
        ending: What became of it.
        basis: Number of entries that its computation knew of.
        time: When it ended [s since 1970].
        seconds: How long it took [s].
        text: Its message, if any.
    """

    command: AbstractCommand
    ending: Ending
    basis: int
    time: float
    seconds: float
    text: str = ""


def replay(session: Session, entries: Iterable[Entry]) -> Session:
    """The session that the done commands lead to from the same beginning; messages are left out."""
    snapshots = [session]
    for entry in entries:
        command, now = entry.command, snapshots[-1]
        if entry.ending is not Ending.DONE:
            pass
        elif isinstance(command, AbstractChange):
            now = command.apply(now)
        elif isinstance(command, AbstractTask):
            basis = snapshots[entry.basis]
            result = command.compute(basis, progress=lambda fraction, text: None, cancel=lambda: False)
            now = command.finish(now, result)
        snapshots.append(now)
    return snapshots[-1]
