"""Reopening a recording: the session after its last command, compared with what was recorded.

What changes a session at once is done again; plates that were searched for are taken from the journal, files
from the recording's folder; fits are computed again, and the last numbers compared. Another version, or an
installation without a plug-in, may compute another session from the same commands. It is not the one that was
recorded: its user is told, and it goes on in a recording of its own.
"""

import math
from dataclasses import dataclass
from typing import Any

from workbench.arm.effects import EFFECTS
from workbench.base.installed_package import package_version
from workbench.base.progress import progress
from workbench.report.json import document
from workbench.report.result_fields import ResultFields
from workbench.session.command import UnknownCommand
from workbench.session.journal.numbers import ROUNDING, Difference, changed_numbers, compare
from workbench.session.journal.reader import Recording
from workbench.session.journal.replay import steps, stored_steps
from workbench.session.page_state import Severity
from workbench.session.state import Session

MEAN_ERROR = "position_mm.mean"


@dataclass(frozen=True, eq=False)
class Restored:
    """A recording that was opened again.

    Args:
        session: After the last command.
        recording: As it was read.
        compared: How many values were compared.
        differences: Recorded numbers that don't come out again, the most telling one first.
    """

    session: Session
    recording: Recording
    compared: int
    differences: tuple[Difference, ...] = ()

    @property
    def text(self) -> str:
        if not self.differences:
            return "all the same"
        step = self.differences[0].step
        where = f"after step {step}" if step else "at the start"
        return f"{len(self.differences)} differ, {where}: {_number(self.differences[0])}"

    @property
    def warning(self) -> str:
        """The most telling difference in one sentence; empty if there is none."""
        if not self.differences:
            return ""
        step, where = self.differences[0].step, self.recording.folder.name
        if step:
            where = f"step {step} of {where} ({self.recording.lines[step - 1].title})"
        return f"{where} no longer gives the recorded value: {_number(self.differences[0])}; {self.reason}"

    @property
    def reason(self) -> str:
        """Why it probably gives another result here."""
        found = self.recording
        if unknown := [e.command.name for e in found.entries if isinstance(e.command, UnknownCommand)]:
            return f"the command '{unknown[-1]}' is unknown here"
        if missing := sorted(name for line in found.lines for name in _effects(line.numbers)):
            return f"the effect '{missing[0]}' is not installed here"
        then, now = found.header.get("workbench", "unknown"), package_version()
        if then != now:
            return f"it was recorded by version {then}, this is {now}"
        return "probably the program or a file has changed since, or a plug-in is missing"

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
    session, lines = recording.first, recording.lines
    again = (steps if is_computed else stored_steps)(session, recording.entries)
    for number, (line, after) in enumerate(zip(lines, again, strict=True), start=1):
        session = after
        progress(number / len(lines), line.title)
    if recording.skipped:
        session = session.with_message(Severity.WARNING, recording.skipped)
    now, then = changed_numbers(session, None), dict[str, tuple[int, Any]]()
    for step, numbers in enumerate([recording.header["numbers"], *(line.numbers for line in lines)]):
        then |= {name: (step, value) for name, value in numbers.items() if name in now}
    pairs = [
        pair
        for name, (step, value) in then.items()
        for pair in compare(value, now[name], step=step, name=name)
    ]
    found = sorted((pair for pair in pairs if pair.size > ROUNDING), key=_rank)
    return Restored(session, recording, len(pairs), tuple(found))


def _rank(difference: Difference) -> tuple[bool, int, bool, float]:
    """Errors before other values, then by step, numbers before the rest, large changes before small ones."""
    size = difference.size
    return not difference.name.endswith(MEAN_ERROR), difference.step, math.isinf(size), -size


def _number(difference: Difference) -> str:
    name, unit = difference.name, ""
    if name.endswith(MEAN_ERROR):
        name = "mean error of the " + ("held-out" if "held_out" in name else "fitted") + " rows"
        unit = " mm"
    then, now = (
        f"{value:.4g}" if isinstance(value, float) else str(value)[:40]
        for value in (difference.then, difference.now)
    )
    return f"{name} {then} → {now}{unit}"


def _effects(numbers: dict[str, Any]) -> list[str]:
    """Names of the effects that a diagnosis had found and that are not installed."""
    try:
        names = [str(effect["name"]) for effect in numbers["diagnosis"]["effects"]]
    except (KeyError, TypeError):
        return []
    return [name for name in names if name not in EFFECTS]
