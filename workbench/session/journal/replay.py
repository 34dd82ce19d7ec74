"""Replaying the commands of a journal.

A task is computed from the session at its start and put into the session at its end, with other commands
in between. Its entry says how many entries there were at its start, so that a replay does the same.

Once a command is unknown here, what it did is missing: later commands that can't go without are left out.
"""

from collections.abc import Iterable, Iterator

from workbench.base.errors import OptionError
from workbench.base.progress import running
from workbench.session.command import AbstractChange, AbstractCommand, AbstractTask, UnknownCommand
from workbench.session.journal.entry import Ending, Entry
from workbench.session.state import Session


def replay(session: Session, entries: Iterable[Entry]) -> Session:
    """The session that the done commands lead to from the same beginning; messages are left out."""
    for after in steps(session, entries):
        session = after
    return session


def steps(session: Session, entries: Iterable[Entry]) -> Iterator[Session]:
    entries = tuple(entries)
    wanted = {entry.basis for entry in entries if isinstance(entry.command, AbstractTask)}
    bases, is_lacking = {0: session}, False
    for number, entry in enumerate(entries, start=1):
        if entry.ending is Ending.DONE:
            is_lacking |= isinstance(entry.command, UnknownCommand)
            session = do_again(session, entry, bases, step=number, is_lacking=is_lacking)
        if number in wanted:
            bases[number] = session
        yield session


def do_again(
    session: Session, entry: Entry, bases: dict[int, Session], *, step: int, is_lacking: bool
) -> Session:
    """Execute one recorded command, a task from the session that it started from.

    Args:
        is_lacking: Whether a command before was unknown: one that now can't be carried out is left out.
    """
    try:
        return _do_again(session, entry.command, bases.get(entry.basis))
    except Exception as error:  # a command that was changed raises nearly anything
        if is_lacking:
            return session
        raise OptionError(
            f"step {step} ({entry.command.title}) can't be replayed ({type(error).__name__}: {error}); "
            f"--step {step - 1} opens the session before it"
        ) from error


def _do_again(session: Session, command: AbstractCommand, basis: Session | None) -> Session:
    if isinstance(command, AbstractChange):
        return command.apply(session)
    assert isinstance(command, AbstractTask)
    assert basis is not None, "it starts from a step that is missing"
    with running():
        result = command.compute(basis)
    return command.finish(session, result)
