"""Replaying the commands of a journal.

A task is computed from the session at its start and put into the session at its end, with other commands
in between. Its entry says how many entries there were at its start, so that a replay does the same.

Once a command is unknown here, what it did is missing: later commands that can't go without are left out.
"""

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from workbench.base.errors import OptionError, WorkbenchError
from workbench.base.progress import part_of
from workbench.session.command import AbstractChange, AbstractTask, UnknownCommand
from workbench.session.journal import records
from workbench.session.journal.entry import Ending, Entry
from workbench.session.state import Session

log = logging.getLogger(__name__)


def replay(session: Session, entries: Iterable[Entry]) -> Session:
    """The session that the done commands lead to from the same beginning; messages are left out."""
    for after in steps(session, [replace(entry, result=None) for entry in entries]):
        session = after
    return session


def steps(session: Session, entries: Sequence[Entry]) -> Iterator[Session]:
    """The session after every command, by the results that are kept; all others are computed."""
    wanted = {entry.basis for entry in entries if isinstance(entry.command, AbstractTask)}
    bases, is_lacking = {0: session}, False
    for number, entry in enumerate(entries, start=1):
        if entry.ending is Ending.DONE:
            is_lacking |= isinstance(entry.command, UnknownCommand)
            try:
                with part_of((number - 1) / len(entries), 1.0 / len(entries)):
                    session = entry.command.named(_do_again(session, entry, bases.get(entry.basis)))
            except Exception as error:  # a command that was changed raises nearly anything
                if not is_lacking:
                    raise OptionError(
                        f"step {number} ({entry.command.title}) can't be replayed ({type(error).__name__}: "
                        f"{error}); --step {number - 1} opens the session before it"
                    ) from error
        if number in wanted:
            bases[number] = session
        yield session


def _do_again(session: Session, entry: Entry, basis: Session | None) -> Session:
    command = entry.command
    if isinstance(command, AbstractChange):
        try:
            command.check(session)
        except WorkbenchError as refusal:  # older versions let such a step pass and do nothing
            log.info("'%s' is left out: %s", command.title, refusal)
            return session
        return command.apply(session)
    assert isinstance(command, AbstractTask)
    assert basis is not None, "it starts from a step that is missing"
    if entry.result is not None:
        try:
            return command.finish(session, records.unpack(entry.result, records.known(basis)))
        except Exception:  # of another version, or changed: it is computed as by that one
            log.info("the result of '%s' is computed again", command.title)
    return command.finish(session, command.compute(basis))
