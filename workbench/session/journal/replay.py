"""Replaying the commands of a journal, and reopening a recording.

A task is computed from the session at its start and put into the session at its end, with other commands
in between. Its entry says how many entries there were at its start, so that a replay does the same.
Once a command is unknown here, what it did is missing: later commands that can't go without are left out.

To reopen a recording, what changes a session at once is done again, files are taken from its folder. Searches
and fits are read where they were recorded on this machine, by whichever version, else computed again, and
their numbers compared. Another version, or an installation without a plug-in, may compute another session
from the same commands. It is not the one that was recorded: its user is told, and it goes on in a recording
of its own.
"""

import json
import logging
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

from workbench.base.errors import OptionError, WorkbenchError
from workbench.base.installed_package import package_version
from workbench.base.progress import part_of, progress
from workbench.report.json import document
from workbench.report.result_fields import ResultFields
from workbench.session.command import AbstractChange, AbstractChore, AbstractTask, UnknownCommand
from workbench.session.journal import codec, records
from workbench.session.journal.numbers import ROUNDING, Difference, compare, numbers_of
from workbench.session.journal.reader import Recording
from workbench.session.page_state import Severity
from workbench.session.state import Session
from workbench.session.view import Ending, Entry

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
                    after = _do_again(session, entry, bases.get(entry.basis))
                    session = entry.command.done(session, after)
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


@dataclass(frozen=True, eq=False)
class Restored:
    """A recording that was opened again.

    Args:
        session: After the last command.
        recording: With the numbers that come out now.
        compared: How many values were compared.
        differences: Recorded numbers that don't come out again.
        reason: The probable one.
    """

    session: Session
    recording: Recording
    compared: int
    differences: tuple[Difference, ...] = ()
    reason: str = ""

    @property
    def warning(self) -> str:
        """The most telling difference in one sentence; empty if there is none."""
        if not self.differences:
            return ""
        worst = max(self.differences, key=lambda d: (math.isfinite(d.size), d.size))
        where = self.recording.folder.name
        if worst.step:
            where = f"step {worst.step} of {where} ({self.recording.lines[worst.step - 1].title})"
        return f"{where} no longer gives the recorded value: {worst.text}; {self.reason}"

    def json(self) -> dict[str, Any]:
        return document(
            "workbench.replay/1",
            steps=len(self.recording.lines),
            compared=self.compared,
            differences=ResultFields("step", "name", "then", "now").each(self.differences),
        )


def restore(recording: Recording, *, is_computed: bool = False) -> Restored:
    """The session after the recording's last command, to go on from there.

    Args:
        recording: As it was read.
        is_computed: Whether searches and chores are computed again, too.
    """
    entries = recording.entries
    written = [recording.header["numbers"], *(line.numbers for line in recording.lines)]
    if is_computed:
        entries = tuple(replace(entry, result=None) for entry in entries)
    else:  # some chores are left to the session, which asks for them by itself
        is_left = lambda done: isinstance(done, AbstractChore) and done.is_redone  # noqa: E731
        entries = tuple(replace(e, ending=Ending.CANCELLED) if is_left(e.command) else e for e in entries)
    after = steps(recording.first, entries)
    compared, found, now = 0, list[Difference](), dict[int, dict[str, Any]]()
    for step, (then, session) in enumerate(zip(written, chain([recording.first], after), strict=True)):
        numbers = numbers_of(session, then)
        pairs = list(compare(then, numbers, step=step))
        compared += len(pairs)
        if unequal := [pair for pair in pairs if pair.size > ROUNDING]:
            found, now[step] = [*found, *unequal], numbers
        following = entries[step].command.title if step < len(entries) else ""
        progress(step / max(len(entries), 1), following)
    session = session.without_messages(lambda m: m.severity is Severity.ERROR)  # told at the time
    if recording.skipped:
        session = session.with_message(Severity.WARNING, recording.skipped)
    if not found:
        return Restored(session, recording, compared)
    header = recording.header | {"workbench": package_version(), "numbers": now.get(0, written[0])}
    lines = list(recording.lines)
    for k, line in ((step - 1, lines[step - 1]) for step in now if step):
        fields = {name: value for name, value in json.loads(line.text).items() if name != codec.CHECK}
        text = json.dumps(fields | {"numbers": now[k + 1]}, ensure_ascii=False, allow_nan=False)
        lines[k] = replace(line, numbers=now[k + 1], text=codec.sealed(text))
    rewritten = replace(recording, lines=tuple(lines), header=header)
    reason = "probably the program has changed since, or an extra with a command or an effect is missing"
    if (by := recording.header.get("workbench", "unknown")) != package_version():
        reason = f"it was recorded by version {by}, this is {package_version()}"
    return Restored(session, rewritten, compared, tuple(found), reason)
