"""Reopening a recording: the session after its last command, compared with what was recorded.

Another version, or an installation without a plug-in, may compute another session from the same commands. It
is not the one that was recorded: its user is told, and it goes on in a recording of its own.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.arm.effects import EFFECTS
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.installed_package import package_version
from workbench.base.progress import progress
from workbench.data.readers.layouts import PLAIN, layout_names
from workbench.session.command import AbstractChange, AbstractChore, AbstractTask, UnknownCommand
from workbench.session.journal import codec
from workbench.session.journal.compare_numbers import ROUNDING, Difference, compare
from workbench.session.journal.entry import Ending, Entry
from workbench.session.journal.numbers import numbers_of
from workbench.session.journal.reader import JournalLine, Recording
from workbench.session.journal.replay import do_again
from workbench.session.restored_targets import with_full_scores
from workbench.session.state import Session

MEAN_ERROR = "position_mm.mean"
MET = 1e-6
"""Maximum distance of the tool from a target that a recorded posture meets [m, rad]."""


@dataclass(frozen=True, eq=False)
class Restored:
    """A recording that was opened again.

    Args:
        session: After the last command.
        recording: With the numbers that come out now.
        differences: Recorded numbers that don't come out again.
        reason: The probable one.
    """

    session: Session
    recording: Recording
    differences: tuple[Difference, ...] = ()
    reason: str = ""

    @property
    def warning(self) -> str:
        """The most telling difference in one sentence; empty if there is none."""
        if not self.differences:
            return ""
        worst = max(
            self.differences, key=lambda d: (d.name.endswith(MEAN_ERROR), np.isfinite(d.size), d.size)
        )
        title = self.recording.lines[worst.step - 1].title
        return (
            f"step {worst.step} of {self.recording.folder.name} ({title}) no longer gives "
            f"the recorded value: {_number(worst)}; {self.reason}"
        )


def restore(recording: Recording) -> Restored:
    """The session after the recording's last command, to go on from there.

    What a command can recall from the journal's numbers (the steps of drags) is taken from there, to the last
    digit. All other commands are done again, from a session in which nothing is missing, and compared with
    what was recorded. Chores that the session will ask for again by itself, once their result is shown, are
    left out.

    Args:
        recording: As it was read.
    """
    session, lines = recording.first, list(recording.lines)
    bases, differences, is_lacking = {0: session}, list[Difference](), False
    begun_from = {e.basis for e in recording.entries if isinstance(e.command, AbstractTask) and _is_needed(e)}
    for number, line in enumerate(recording.lines, start=1):
        if _is_needed(line.entry):
            is_lacking |= isinstance(line.entry.command, UnknownCommand)
            known = None if is_lacking else _recalled(session, line)  # numbers are of another session
            if known is None:
                progress(number / len(lines), line.title)
                session = with_full_scores(session)
                known = do_again(session, line.entry, bases, step=number, is_lacking=is_lacking)
                now = numbers_of(known, line.numbers)
                if found := [d for d in compare(line.numbers, now, step=number) if d.size > ROUNDING]:
                    differences += found
                    lines[number - 1] = _rewritten(line, now)
            session = known
        if number in begun_from:
            bases[number] = session = with_full_scores(session)
    session = with_full_scores(session)
    if not differences:
        return Restored(session, recording)
    header = recording.header | {"workbench": package_version()}
    now_recorded = replace(recording, lines=tuple(lines), header=header)
    return Restored(session, now_recorded, tuple(differences), _reason(recording, differences[0].step))


def _is_needed(entry: Entry) -> bool:
    is_redone = isinstance(entry.command, AbstractChore) and entry.command.is_redone
    return entry.ending is Ending.DONE and not is_redone


def _recalled(session: Session, line: JournalLine) -> Session | None:
    """The session afterwards from the journal's numbers; None where they are not enough or contradictory."""
    command = line.entry.command
    known = command.recalled(session, line.numbers) if isinstance(command, AbstractChange) else None
    return known if known is None or line.is_sealed or _meets_targets(known, line) else None


def _meets_targets(session: Session, line: JournalLine) -> bool:
    """Whether the recorded postures reach their targets, as far as they are said to."""
    found = [int(name) - 1 for name in line.numbers.get("targets", {})]
    found = [i for i in found if session.states[i].reached]
    if not found or session.robot.dof < 6:  # an arm of fewer joints need not meet the orientation
        return True
    tools = tool_poses(session.robot, Motion(np.array([session.states[i].q for i in found])))
    errors = se3.pose_error(session.plate.poses[found], se3.inverse(session.robot.base.pose) @ tools)
    return bool(np.abs(errors).max() < MET)


def _rewritten(line: JournalLine, numbers: dict[str, Any]) -> JournalLine:
    fields = {name: value for name, value in json.loads(line.text).items() if name != codec.CHECK}
    text = json.dumps(fields | {"numbers": numbers}, ensure_ascii=False, allow_nan=False)
    return replace(line, numbers=numbers, text=codec.sealed(text))


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


def _reason(recording: Recording, step: int) -> str:
    """Why a step probably gives another result here."""
    commands = (entry.command for entry in recording.entries[:step])
    if unknown := [c.name for c in commands if isinstance(c, UnknownCommand)]:
        return f"the command '{unknown[-1]}' is unknown here"
    missing = sorted(name for name in _effects(recording.lines[step - 1].numbers) if name not in EFFECTS)
    if missing:
        return f"the effect '{missing[0]}' is not installed here"
    layout = (recording.lines[step - 1].numbers.get("data") or {}).get("layout", PLAIN)
    if layout not in layout_names():
        return f"what reads the layout '{layout}' is not installed here"
    then, now = recording.header.get("workbench", "unknown"), package_version()
    if then != now:
        return f"it was recorded by version {then}, this is {now}"
    return "probably the program has changed since, or a plug-in is missing"


def _effects(numbers: dict[str, Any]) -> Iterator[str]:
    found = numbers.get("diagnosis") or {}
    yield from (str(effect["name"]) for part in ("effects", "causes") for effect in found.get(part, ()))
    yield from (str(effect["effect"]) for effect in (numbers.get("accepted") or {}).values())
