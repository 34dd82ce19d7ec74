"""Shared helpers of target commands: undo steps, the score after a change, the history of scores."""

from dataclasses import replace
from functools import partial

import numpy as np

from workbench.base.errors import OptionError
from workbench.identification.problem_blocks import Noise
from workbench.plate.optimiser.target_blocks import overlapping_blocks
from workbench.plate.plate import Plate, Target
from workbench.plate.target_readings import sigma_of, usual_kind
from workbench.session.command import AbstractChange
from workbench.session.live_score import score
from workbench.session.state import UNDO_STEPS, WHOLE, Focus, Session, UndoStep
from workbench.session.target_postures import TargetState, settled, solve_all_targets


def check_free(session: Session) -> None:
    """Refuse while somebody drags."""
    if session.drag is not None:
        raise OptionError(f"target {session.drag.target + 1} is being dragged; wait until it is released")


class AbstractTargetStep(AbstractChange):
    """A change of the targets that has to wait for the end of a drag; of one `target`, it must be there."""

    def check(self, session: Session) -> None:
        session.check_target(getattr(self, "target", 0))
        check_free(session)


def check_unlocked(session: Session, number: int) -> None:
    """Refuse to move a locked target."""
    session.check_target(number)
    if session.plate.targets[number].locked:
        raise OptionError(f"target {number + 1} is locked; unlock it to move it")


def begin_step(session: Session, *, is_whole: bool = False) -> Session:
    """Make the current targets, or the whole session, what undo restores, below the step of a drag."""
    done, dragged = session.history.done, 0 if session.drag is None else 1
    place = len(done) - dragged
    done = (*done[:place], UndoStep.of(session, is_whole=is_whole), *done[place:])
    whole = [k for k, step in enumerate(done) if step.session is not None]
    first = whole[-WHOLE] if len(whole) > WHOLE else 0  # of those that are kept
    return session.updated("history", done=done[first:][-UNDO_STEPS:], undone=())


def with_targets(session: Session, plate: Plate, states: tuple[TargetState, ...]) -> Session:
    """The session with these targets, scored."""
    chosen = min(session.selected, len(plate) - 1)
    found = score(session.robot, plate, states, noise=session.noise, region_q=session.region.q)
    session = session.updated("playback", focus=Focus.TARGET)
    return replace(session, plate=plate, states=states, score=found, selected=chosen)


def move_targets(session: Session, plate: Plate, states: tuple[TargetState, ...]) -> Session:
    """The session with these targets, scored, as a separate step."""
    return finish_step(begin_step(session), plate, states)


def place_plate(session: Session, plate: Plate) -> Session:
    """The session with this plate, the arm in the best of the mixes of branches that are tried."""
    return move_targets(session, plate, solve_all_targets(session.robot, plate, region_q=session.region.q))


def finish_step(session: Session, plate: Plate, states: tuple[TargetState, ...]) -> Session:
    """The session after a step: no target is blocked without need, their score enters the history."""
    session = replace(session, noise=instrument_for(session, plate))
    return with_history(with_targets(session, plate, settled(session.robot, plate, states)))


def with_history(session: Session) -> Session:
    """The session with its targets in the history, and as the best ones if they are."""
    history, step = session.history, UndoStep.of(session)
    best = step if history.best is None or is_better(step, history.best) else history.best
    past = (*history.past, step)[-UNDO_STEPS:]
    return replace(session, history=replace(history, past=past, best=best))


def instrument_for(session: Session, plate: Plate) -> Noise:
    """The session's instrument at another plate; the usual one there, if it is the usual one of its own."""
    own, other = (Noise(*sigma_of(usual_kind(each))) for each in (session.plate, plate))
    return other if session.noise == own != other else session.noise


def rescore(session: Session) -> Session:
    """The session after what the scores mean has changed: now, first and best are compared alike."""
    judge = partial(score, session.robot, noise=session.noise, region_q=session.region.q)
    first = session.history.first
    first = replace(first, score=judge(first.plate, first.states))
    history = replace(session.history, first=first, past=(), best=None)
    return with_history(replace(session, score=judge(session.plate, session.states), history=history))


def is_better(step: Session | UndoStep, other: Session | UndoStep) -> bool:
    """Blocks that don't overlap; less error predicted in the region, or, where unknown, a larger O1."""
    if (lacks := bool(overlapping_blocks(step.plate))) != bool(overlapping_blocks(other.plate)):
        return not lacks
    score, than = step.score, other.score
    if np.isnan(score.position) or np.isnan(than.position):
        return score.indices["O1"] > than.indices["O1"]
    return score.position < than.position


def with_target(
    session: Session, number: int, target: Target, state: TargetState
) -> tuple[Plate, tuple[TargetState, ...]]:
    """Plate and states with another target in place of one."""
    targets, states = list(session.plate.targets), list(session.states)
    targets[number], states[number] = target, state
    return replace(session.plate, targets=tuple(targets)), tuple(states)
