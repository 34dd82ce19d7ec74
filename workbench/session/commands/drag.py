"""Commands of one drag: select, grab, move, drop.

A drag is one grab, any number of moves, and one drop. While somebody holds a target, others can't move it.
A move without a grab (typed coordinates) is a step of its own. Undo goes back to before the whole drag.
"""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.session.command import AbstractChange
from workbench.session.reach import advance, settle
from workbench.session.state import (
    Focus,
    Holder,
    Session,
    TargetState,
)
from workbench.session.target_steps import (
    check_free,
    check_unlocked,
    remember,
    settled,
    stand,
    with_item,
    with_ways,
)

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
        return f"Select target {self.target + 1}"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        session.check_target(self.target)
        if session.holder is not None and session.holder.target != self.target:
            raise OptionError(
                f"target {session.holder.target + 1} is being dragged; select another one when it is let go"
            )

    def apply(self, session: Session) -> Session:
        return with_ways(replace(session, selected=self.target, focus=Focus.TARGET))


@dataclass(frozen=True)
class GrabTarget(AbstractChange):
    """Begin to drag a target: nobody else can move it until it is dropped."""

    target: int
    client: int = NOBODY

    @property
    def title(self) -> str:
        return f"Grab target {self.target + 1}"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        check_unlocked(session, self.target)

    def apply(self, session: Session) -> Session:
        if session.holder is not None:
            return session
        holder = Holder(self.client, self.target)
        return replace(remember(session), holder=holder, selected=self.target, focus=Focus.TARGET)


@dataclass(frozen=True)
class Posture:
    """How the arm stood at a target.

    Args:
        q: Joint positions [rad or m].
        reached: Whether the tool met the target within the joint limits.
        branch: Name of the inverse-kinematics solution; empty where none was reached.
    """

    q: tuple[float, ...]
    reached: bool
    branch: str = ""

    @classmethod
    def of(cls, state: TargetState) -> "Posture":
        """The posture of a target's state."""
        return cls(tuple(state.q.tolist()), state.reached, state.branch)

    @property
    def state(self) -> TargetState:
        """As far as the next place of a drag is followed from it."""
        return TargetState(frozen(np.array(self.q)), self.reached, self.branch)


@dataclass(frozen=True)
class MoveTarget(AbstractChange):
    """Put a target somewhere, in the robot's base: by dragging, or with typed coordinates.

    Args:
        target: Which one, counted from 0.
        xyz: Position of the tool [m].
        rpy: Its roll, pitch, yaw [rad].
        client: Who drags; the holder's moves belong to the drag, other moves are steps of their own.
        start: The posture from which the arm is followed; as it stands, if None.
    """

    target: int
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float]
    client: int = NOBODY
    start: Posture | None = None

    @property
    def title(self) -> str:
        return f"Move target {self.target + 1}"

    @property
    def key(self) -> Hashable | None:
        return ("move", self.target, self.client)

    def check(self, session: Session) -> None:
        check_unlocked(session, self.target)
        if self.client == NOBODY:
            check_free(session)
        check_place(self.target, self.xyz, self.rpy)

    def apply(self, session: Session) -> Session:
        holder = session.holder
        if holder is not None and (holder.client, holder.target) != (self.client, self.target):
            return session
        old = session.plate.targets[self.target]
        target = replace(old, xyz=frozen(np.array(self.xyz)), rpy=frozen(np.array(self.rpy)), q=None)
        before = session.states[self.target] if self.start is None else self.start.state
        state = advance(session.robot, session.plate, target, before)
        plate = replace(session.plate, targets=with_item(session.plate.targets, self.target, target))
        states = with_item(session.states, self.target, state)
        if holder is not None:
            return stand(session, plate, states, selected=self.target)
        return settled(stand(remember(session), plate, states, selected=self.target))


@dataclass(frozen=True)
class DropTarget(AbstractChange):
    """End a drag, or let go what a client that has left was holding."""

    client: int = NOBODY

    @property
    def title(self) -> str:
        return "Let go"

    @property
    def key(self) -> Hashable | None:
        return None

    def check(self, session: Session) -> None:
        """Nothing can be wrong with letting go."""

    def apply(self, session: Session) -> Session:
        if session.holder is None or session.holder.client != self.client:
            return session
        index = session.holder.target
        session = replace(session, holder=None)
        if session.done[-1].plate is session.plate:
            return replace(session, done=session.done[:-1])
        session = with_ways(session, index)
        state = settle(session.plate.targets[index], session.states[index], session.ways)
        return settled(replace(session, states=with_item(session.states, index, state)))


def check_place(number: int, xyz: tuple[float, ...], rpy: tuple[float, ...]) -> None:
    """Refuse a place that is not finite, or absurdly far away."""
    if not np.isfinite((*xyz, *rpy)).all():
        raise OptionError(f"target {number + 1} can't be put at a place that is not a finite number")
    if max(abs(v) for v in xyz) > FARTHEST:
        raise OptionError(
            f"target {number + 1} would be {max(abs(v) for v in xyz):.3g} m away; "
            f"keep it within {FARTHEST:g} m of the base"
        )
