"""Coming to a recording's last state quickly, to go on from there.

All commands are done again, but the places in the middle of a drag are taken as the journal has them: only
the last one before something else happens is worked out, from the one before it. The cubes of the region are
left to the session, which works them out by the way when they are shown.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.session.command import AbstractTask
from workbench.session.commands import MapCubes, MoveTarget
from workbench.session.journal.entry import Ending
from workbench.session.journal.reader import Line, Recording
from workbench.session.journal.replay import do_again
from workbench.session.state import Session, TargetState
from workbench.session.steps import with_item
from workbench.types import frozen


def restore(recording: Recording) -> Session:
    """The session after the recording's last command."""
    session = recording.first
    bases = {0: session}
    wanted = {e.basis for e in recording.entries if isinstance(e.command, AbstractTask)}
    following: Iterable[Line | None] = (*recording.lines[1:], None)
    for number, (line, after) in enumerate(zip(recording.lines, following, strict=True), start=1):
        if line.entry.ending is Ending.DONE:
            session = _done(session, line, after, bases, last=number in wanted)
        if number in wanted:
            bases[number] = session
    return session


def _done(
    session: Session, line: Line, after: Line | None, bases: dict[int, Session], *, last: bool
) -> Session:
    if isinstance(line.entry.command, MapCubes):
        return session
    if after is not None and not last and _is_passed(session, line, after):
        return _as_written(session, line)
    return do_again(session, line.entry, bases)


def _is_passed(session: Session, line: Line, after: Line) -> bool:
    """Whether the next command moves the same target on in the same hand."""
    one, other, holder = line.entry.command, after.entry.command, session.holder
    if not (isinstance(one, MoveTarget) and isinstance(other, MoveTarget)) or holder is None:
        return False
    same = (one.target, one.client) == (other.target, other.client) == (holder.target, holder.client)
    is_known = str(one.target + 1) in line.numbers.get("targets", {})
    return same and is_known and after.entry.ending is Ending.DONE


def _as_written(session: Session, line: Line) -> Session:
    """The session with the target as the journal has it; its score is left for later."""
    command = line.entry.command
    assert isinstance(command, MoveTarget)
    number = command.target
    xyz, rpy = frozen(np.array(command.xyz)), frozen(np.array(command.rpy))
    target = replace(session.plate.targets[number], xyz=xyz, rpy=rpy, q=None)
    state = _state(line.numbers["targets"][str(number + 1)])
    plate = replace(session.plate, targets=with_item(session.plate.targets, number, target))
    return replace(session, plate=plate, states=with_item(session.states, number, state))


def _state(numbers: dict[str, Any]) -> TargetState:
    known = {key: value for key, value in numbers.items() if key not in ("xyz", "rpy", "q", "missing")}
    position, rotation = numbers["missing"]
    return TargetState(q=frozen(np.array(numbers["q"])), missing=(position, rotation), **known)
