"""Coming to a recording's last state quickly, to go on from there.

What drags led to is taken as the journal has it, to the last digit: where every target stands, how the arm
stands there, and what that scores. All other commands are done again, from a session in which nothing is
missing. The cubes of the region are left to the session, which works them out by the way when they are shown.
"""

from workbench.session.command import AbstractTask, Progress
from workbench.session.commands import MapCubes
from workbench.session.journal.entry import Ending, Entry
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import do_again
from workbench.session.journal.taken import completed, taken
from workbench.session.state import Session


def restore(recording: Recording, *, progress: Progress = lambda part, text: None) -> Session:
    """The session after the recording's last command.

    Args:
        recording: As it was read.
        progress: Told of every command that is done again: the share of the recording, and its title.
    """
    session = recording.first
    bases = {0: session}
    wanted = {e.basis for e in recording.entries if isinstance(e.command, AbstractTask) and _counts(e)}
    for number, line in enumerate(recording.lines, start=1):
        if _counts(line.entry):
            known = taken(session, line)
            if known is None:
                progress(number / len(recording.lines), line.title)
                known = do_again(completed(session), line.entry, bases)
            session = known
        if number in wanted:
            bases[number] = session = completed(session)
    return completed(session)


def _counts(entry: Entry) -> bool:
    return entry.ending is Ending.DONE and not isinstance(entry.command, MapCubes)
