"""The steps of a drag as a journal has them, without working them out again.

The scores on the way have their numbers, and lack what is only shown of the present one: see `completed`.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.base.types import frozen
from workbench.session.commands import (
    DropTarget,
    GrabTarget,
    MoveTarget,
    SelectTarget,
)
from workbench.session.journal.reader import Line
from workbench.session.score import score
from workbench.session.state import (
    Focus,
    Score,
    Session,
    Step,
    TargetState,
)
from workbench.session.target_steps import (
    counted,
    remember,
    with_item,
    with_ways,
)


def taken(session: Session, line: Line) -> Session | None:
    """The session after a done command of a drag; None where the command has to be done again."""
    take = WAYS.get(type(line.entry.command))
    return None if take is None else take(session, line)


def completed(session: Session) -> Session:
    """The session with all that is shown of its present score, and the ways to its target."""
    now, best = session.score, session.best_score
    if now.linearisation is None:
        now = _scored(session, Step(session.plate, session.states))
    if best is session.score:
        best = now
    elif best is not None and best.linearisation is None and session.best is not None:
        best = _scored(session, session.best)
    history = session.history
    if history and history[-1] is session.score:
        history = (*history[:-1], now)
    return with_ways(replace(session, score=now, best_score=best, history=history))


def _scored(session: Session, step: Step) -> Score:
    return score(session.robot, step.plate, step.states, noise=session.noise, region_q=session.region_q)


def _select(session: Session, line: Line) -> Session:
    command = line.entry.command
    assert isinstance(command, SelectTarget)
    return replace(session, selected=command.target, focus=Focus.TARGET)


def _grab(session: Session, line: Line) -> Session:
    command = line.entry.command
    assert isinstance(command, GrabTarget)
    return command.apply(session)


def _move(session: Session, line: Line) -> Session:
    command, holder = line.entry.command, session.holder
    assert isinstance(command, MoveTarget)
    if holder is not None and (holder.client, holder.target) != (command.client, command.target):
        return session
    number = command.target
    target = replace(
        session.plate.targets[number],
        xyz=frozen(np.array(command.xyz)),
        rpy=frozen(np.array(command.rpy)),
        q=None,
    )
    plate = replace(session.plate, targets=with_item(session.plate.targets, number, target))
    session = session if holder is not None else remember(session)
    session = replace(session, plate=plate, selected=number, focus=Focus.TARGET)
    return _standing(session, line) if holder is not None else counted(_standing(session, line))


def _drop(session: Session, line: Line) -> Session:
    command = line.entry.command
    assert isinstance(command, DropTarget)
    holder = session.holder
    if holder is None or holder.client != command.client or session.done[-1].plate is session.plate:
        return command.apply(session)
    return counted(_standing(replace(session, holder=None), line))


def _standing(session: Session, line: Line) -> Session:
    """The session with the arm at its targets, and the score, as they were written."""
    states = list(session.states)
    for name, numbers in line.numbers.get("targets", {}).items():
        states[int(name) - 1] = _state(numbers)
    numbers = line.numbers.get("score")
    now = session.score if numbers is None else _score(numbers, session)
    return replace(session, states=tuple(states), score=now)


def _state(numbers: dict[str, Any]) -> TargetState:
    known = {key: value for key, value in numbers.items() if key not in ("xyz", "rpy", "q", "missing")}
    position, rotation = numbers["missing"]
    return TargetState(q=frozen(np.array(numbers["q"])), missing=(position, rotation), **known)


def _score(numbers: dict[str, Any], session: Session) -> Score:
    """A score by its numbers; what is infinite or unknown was written as nothing."""
    open_ = math.inf if len(session.region_q) or not numbers["reached"] else math.nan
    position, rotation = (
        open_ if numbers[part] is None else numbers[part] for part in ("position", "rotation")
    )
    return Score(
        per_target=frozen(np.array(numbers["per_target"], float)),
        indices={name: math.inf if v is None else v for name, v in numbers["indices"].items()},
        reached=numbers["reached"],
        rank=numbers["rank"],
        parameters=session.score.parameters,
        condition=math.inf if numbers["condition"] is None else numbers["condition"],
        position=position,
        rotation=rotation,
        rises=frozen(np.full(len(numbers["per_target"]), np.nan)),
    )


WAYS: dict[type, Callable[[Session, Line], Session]] = {
    SelectTarget: _select,
    GrabTarget: _grab,
    MoveTarget: _move,
    DropTarget: _drop,
}
"""How each command of a drag is taken from its line."""
