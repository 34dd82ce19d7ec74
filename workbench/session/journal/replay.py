"""Replaying the commands of a journal.

A task is computed from the session at its start and put into the session at its end, with other commands
in between. Its entry says how many entries there were at its start, so that a replay does the same.
"""

from collections.abc import Iterable, Iterator

from workbench.base.errors import OptionError
from workbench.session.command import AbstractChange, AbstractChore, AbstractCommand, AbstractTask, Progress
from workbench.session.journal.entry import Ending, Entry
from workbench.session.journal.reader import Recording
from workbench.session.restored_targets import with_full_scores
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
            session = do_again(session, entry, bases, step=number)
        if number in wanted:
            bases[number] = session
        yield session


def do_again(session: Session, entry: Entry, bases: dict[int, Session], *, step: int) -> Session:
    """Execute one recorded command, a task from the session that it started from.

    Raises:
        OptionError: it can't be carried out here, as the recording is damaged or of another version.
    """
    try:
        return _do_again(session, entry.command, bases.get(entry.basis))
    except Exception as error:  # a command that was changed raises nearly anything
        raise OptionError(
            f"step {step} ({entry.command.title}) can't be done again ({type(error).__name__}: {error}); "
            f"--step {step - 1} opens the session before it"
        ) from error


def _do_again(session: Session, command: AbstractCommand, basis: Session | None) -> Session:
    if isinstance(command, AbstractChange):
        return command.apply(session)
    assert isinstance(command, AbstractTask)
    assert basis is not None, "it began from a step that is not there"
    result = command.compute(basis, progress=lambda fraction, text: None, cancel=lambda: False)
    return command.finish(session, result)


def restore(recording: Recording, *, progress: Progress = lambda part, text: None) -> Session:
    """The session after the recording's last command, to go on from there.

    What a command can recall from the journal's numbers (the steps of drags) is taken from there, to the last
    digit. All other commands are done again, from a session in which nothing is missing. Chores that the
    session will ask for again by itself, once their result is shown, are left out.

    Args:
        recording: As it was read.
        progress: Called for every command that is done again: the share of the recording, and its title.
    """
    session = recording.first
    bases = {0: session}
    begun_from = {e.basis for e in recording.entries if isinstance(e.command, AbstractTask) and _is_needed(e)}
    for number, line in enumerate(recording.lines, start=1):
        if _is_needed(line.entry):
            command = line.entry.command
            known = command.recalled(session, line.numbers) if isinstance(command, AbstractChange) else None
            if known is None:
                progress(number / len(recording.lines), line.title)
                known = do_again(with_full_scores(session), line.entry, bases, step=number)
            session = known
        if number in begun_from:
            bases[number] = session = with_full_scores(session)
    return with_full_scores(session)


def _is_needed(entry: Entry) -> bool:
    is_redone = isinstance(entry.command, AbstractChore) and entry.command.is_redone
    return entry.ending is Ending.DONE and not is_redone
