"""Doing the commands of a journal again.

A task is computed from the session at its start and put into the session at its end, with other commands
in between. Its entry says how many entries there were at its start, so that a replay does the same.
"""

from collections.abc import Iterable, Iterator

from workbench.session.command import AbstractChange, AbstractTask
from workbench.session.journal.entry import Ending, Entry
from workbench.session.state import Session


def replay(session: Session, entries: Iterable[Entry]) -> Session:
    """The session that the done commands lead to from the same beginning; messages are left out."""
    for after in steps(session, entries):
        session = after
    return session


def steps(session: Session, entries: Iterable[Entry]) -> Iterator[Session]:
    """The session after every entry."""
    entries = tuple(entries)
    wanted = {entry.basis for entry in entries if isinstance(entry.command, AbstractTask)}
    bases = {0: session}
    for number, entry in enumerate(entries, start=1):
        if entry.ending is Ending.DONE:
            session = do_again(session, entry, bases)
        if number in wanted:
            bases[number] = session
        yield session


def do_again(session: Session, entry: Entry, bases: dict[int, Session]) -> Session:
    """Carry one done command out, a task from the session that it began from."""
    command = entry.command
    if isinstance(command, AbstractChange):
        return command.apply(session)
    assert isinstance(command, AbstractTask)
    result = command.compute(bases[entry.basis], progress=lambda fraction, text: None, cancel=lambda: False)
    return command.finish(session, result)
