"""Commands about targets: select, grab, move, drop, undo, redo, reset.

A drag is one grab, any number of moves, and one drop. While somebody holds a target, others can't move it.
A move without a grab (typed coordinates) is a step of its own. Undo goes back to before the whole drag.
"""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from workbench.design.plate import Plate
from workbench.errors import OptionError
from workbench.session.command import AbstractChange
from workbench.session.reach import advance, settle
from workbench.session.score import score
from workbench.session.state import UNDO_STEPS, Focus, Holder, Session, Severity, Step
from workbench.types import frozen

FARTHEST = 10.0
"""Targets beyond this distance from the base are refused [m]."""
NOBODY = 0
"""Client of commands that no browser sent."""


@dataclass(frozen=True)
class SelectTarget(AbstractChange):
    """Look at a target; the arm goes there."""

    target: int

    @property
    def title(self) -> str:
        """Words for the journal."""
        return f"Select target {self.target + 1}"

    @property
    def key(self) -> Hashable | None:
        """Every selection counts."""
        return None

    def check(self, session: Session) -> None:
        """The target must exist, and nobody may be dragging another one."""
        session.check_target(self.target)
        if session.holder is not None and session.holder.target != self.target:
            raise OptionError(
                f"target {session.holder.target + 1} is being dragged; select another one when it is let go"
            )

    def apply(self, session: Session) -> Session:
        """The session afterwards."""
        return replace(session, selected=self.target, focus=Focus.TARGET)


@dataclass(frozen=True)
class GrabTarget(AbstractChange):
    """Begin to drag a target: nobody else can move it until it is dropped."""

    target: int
    client: int = NOBODY

    @property
    def title(self) -> str:
        """Words for the journal."""
        return f"Grab target {self.target + 1}"

    @property
    def key(self) -> Hashable | None:
        """Every grab counts."""
        return None

    def check(self, session: Session) -> None:
        """The target must exist."""
        session.check_target(self.target)

    def apply(self, session: Session) -> Session:
        """The session afterwards; unchanged while somebody else holds a target."""
        if session.holder is not None:
            return session
        holder = Holder(self.client, self.target)
        return replace(_remember(session), holder=holder, selected=self.target, focus=Focus.TARGET)


@dataclass(frozen=True)
class MoveTarget(AbstractChange):
    """Put a target somewhere, in the robot's base: by dragging, or with typed coordinates.

    Args:
        target: Which one, counted from 0.
        xyz: Position of the tool [m].
        rpy: Its roll, pitch, yaw [rad].
        client: Who drags; the holder's moves belong to the drag, other moves are steps of their own.
    """

    target: int
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]
    client: int = NOBODY

    @property
    def title(self) -> str:
        """Words for the journal."""
        return f"Move target {self.target + 1}"

    @property
    def key(self) -> Hashable | None:
        """Only the newest place of one client's drag matters."""
        return ("move", self.target, self.client)

    def check(self, session: Session) -> None:
        """The target must exist, be in nobody's hand, its place finite and not absurdly far away."""
        session.check_target(self.target)
        if self.client == NOBODY:
            _check_free(session)
        if not np.isfinite((*self.xyz, *self.rpy)).all():
            raise OptionError(f"target {self.target + 1} can't be put at a place that is not a finite number")
        if max(abs(v) for v in self.xyz) > FARTHEST:
            raise OptionError(
                f"target {self.target + 1} would be {max(abs(v) for v in self.xyz):.3g} m away; "
                f"keep it within {FARTHEST:g} m of the base"
            )

    def apply(self, session: Session) -> Session:
        """The session afterwards; unchanged while somebody else holds a target."""
        holder = session.holder
        if holder is not None and (holder.client, holder.target) != (self.client, self.target):
            return session
        if holder is None:
            session = _remember(session)
        old = session.plate.targets[self.target]
        target = replace(old, xyz=frozen(np.array(self.xyz)), rpy=frozen(np.array(self.rpy)), q=None)
        state = advance(session.robot, session.plate, target, session.states[self.target])
        targets = _with(session.plate.targets, self.target, target)
        states = _with(session.states, self.target, state)
        plate = replace(session.plate, targets=targets)
        return _rescored(
            replace(session, plate=plate, states=states, selected=self.target, focus=Focus.TARGET)
        )


@dataclass(frozen=True)
class DropTarget(AbstractChange):
    """End a drag, or let go what a client that has left was holding."""

    client: int = NOBODY

    @property
    def title(self) -> str:
        """Words for the journal."""
        return "Let go"

    @property
    def key(self) -> Hashable | None:
        """Every drop counts."""
        return None

    def check(self, session: Session) -> None:
        """Nothing can be wrong with letting go."""

    def apply(self, session: Session) -> Session:
        """The session afterwards; a drag that moved nothing leaves no step behind."""
        if session.holder is None or session.holder.client != self.client:
            return session
        index = session.holder.target
        session = replace(session, holder=None)
        if session.done[-1].plate is session.plate:
            return replace(session, done=session.done[:-1])
        state = settle(session.robot, session.plate.targets[index], session.states[index])
        return replace(session, states=_with(session.states, index, state))


@dataclass(frozen=True)
class Undo(AbstractChange):
    """Take the last move back."""

    @property
    def title(self) -> str:
        """Words for the journal."""
        return "Undo"

    @property
    def key(self) -> Hashable | None:
        """Every step counts."""
        return None

    def check(self, session: Session) -> None:
        """Nobody may be dragging."""
        _check_free(session)

    def apply(self, session: Session) -> Session:
        """The session afterwards."""
        if not session.done:
            return session.tell(Severity.INFO, "there is nothing to undo: no target has been moved")
        step = session.done[-1]
        undone = (*session.undone, Step(session.plate, session.states))
        return _restored(replace(session, done=session.done[:-1], undone=undone), step)


@dataclass(frozen=True)
class Redo(AbstractChange):
    """Make the last undone move again."""

    @property
    def title(self) -> str:
        """Words for the journal."""
        return "Redo"

    @property
    def key(self) -> Hashable | None:
        """Every step counts."""
        return None

    def check(self, session: Session) -> None:
        """Nobody may be dragging."""
        _check_free(session)

    def apply(self, session: Session) -> Session:
        """The session afterwards."""
        if not session.undone:
            return session.tell(Severity.INFO, "there is nothing to redo: no move has been undone")
        step = session.undone[-1]
        done = (*session.done, Step(session.plate, session.states))
        return _restored(replace(session, undone=session.undone[:-1], done=done), step)


@dataclass(frozen=True)
class ResetTargets(AbstractChange):
    """Put all targets back where they were when the plate was loaded; can be undone."""

    @property
    def title(self) -> str:
        """Words for the journal."""
        return "Reset the targets"

    @property
    def key(self) -> Hashable | None:
        """Every reset counts."""
        return None

    def check(self, session: Session) -> None:
        """Nobody may be dragging."""
        _check_free(session)

    def apply(self, session: Session) -> Session:
        """The session afterwards."""
        first = session.first_plate
        if session.plate is first:
            return session.tell(Severity.INFO, f"the targets already stand as in '{first.name}'")
        return _restored(_remember(session), Step(first, session.first_states))


def _check_free(session: Session) -> None:
    if session.holder is not None:
        raise OptionError(f"target {session.holder.target + 1} is being dragged; wait until it is let go")


def _remember(session: Session) -> Session:
    step = Step(session.plate, session.states)
    return replace(session, done=(*session.done, step)[-UNDO_STEPS:], undone=())


def _restored(session: Session, step: Step) -> Session:
    moved = _first_difference(session.plate, step.plate)
    selected = session.selected if moved is None else moved
    return _rescored(
        replace(session, plate=step.plate, states=step.states, selected=selected, focus=Focus.TARGET)
    )


def _first_difference(before: Plate, after: Plate) -> int | None:
    for i, (a, b) in enumerate(zip(before.targets, after.targets, strict=False)):
        if a is not b:
            return i
    return None


def _rescored(session: Session) -> Session:
    new = score(session.robot, session.plate, session.states, noise=session.noise, region_q=session.region_q)
    return replace(session, score=new)


def _with(items: tuple, index: int, item) -> tuple:
    return (*items[:index], item, *items[index + 1 :])
