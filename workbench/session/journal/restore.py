"""Coming to a recording's last state quickly, to go on from there.

What a command can recall from the journal's numbers (the steps of drags) is taken from there, to the last
digit. All other commands are done again, from a session in which nothing is missing. Chores that the session
will ask for again by itself, once their result is shown, are left out.
"""

from workbench.session.command import AbstractChange, AbstractChore, AbstractTask, Progress
from workbench.session.journal.entry import Ending, Entry
from workbench.session.journal.reader import Line, Recording
from workbench.session.journal.replay import do_again
from workbench.session.recalled_steps import completed
from workbench.session.state import Session


def restore(recording: Recording, *, progress: Progress = lambda part, text: None) -> Session:
    """The session after the recording's last command.

    Args:
        recording: As it was read.
        progress: Called for every command that is done again: the share of the recording, and its title.
    """
    session = recording.first
    bases = {0: session}
    begun_from = {e.basis for e in recording.entries if isinstance(e.command, AbstractTask) and _is_needed(e)}
    for number, line in enumerate(recording.lines, start=1):
        if _is_needed(line.entry):
            known = _recalled(session, line)
            if known is None:
                progress(number / len(recording.lines), line.title)
                known = do_again(completed(session), line.entry, bases, step=number)
            session = known
        if number in begun_from:
            bases[number] = session = completed(session)
    return completed(session)


def _recalled(session: Session, line: Line) -> Session | None:
    command = line.entry.command
    return command.recalled(session, line.numbers) if isinstance(command, AbstractChange) else None


def _is_needed(entry: Entry) -> bool:
    is_redone = isinstance(entry.command, AbstractChore) and entry.command.is_redone
    return entry.ending is Ending.DONE and not is_redone
