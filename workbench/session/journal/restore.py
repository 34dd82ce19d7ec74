"""Coming to a recording's last state quickly, to go on from there.

What drags led to is taken as the journal has it, to the last digit: where every target stands, how the arm
stands there, and what that scores. All other commands are done again, from a session in which nothing is
missing. The cubes of the region are left to the session, which works them out by the way when they are shown.
"""

from workbench.session.command import AbstractTask
from workbench.session.commands import MapCubes
from workbench.session.journal.entry import Ending
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import do_again
from workbench.session.journal.taken import completed, taken
from workbench.session.state import Session


def restore(recording: Recording) -> Session:
    """The session after the recording's last command."""
    session = recording.first
    bases = {0: session}
    wanted = {line.entry.basis for line in recording.lines if isinstance(line.entry.command, AbstractTask)}
    for number, line in enumerate(recording.lines, start=1):
        if line.entry.ending is Ending.DONE and not isinstance(line.entry.command, MapCubes):
            known = taken(session, line)
            session = do_again(completed(session), line.entry, bases) if known is None else known
        if number in wanted:
            bases[number] = session = completed(session)
    return completed(session)
