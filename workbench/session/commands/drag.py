"""Commands of one drag: select, grab, move, drop.

A drag is one grab, any number of moves, and one drop. While somebody drags a target, others can't move any.
A move without a grab (typed coordinates) is a step of its own. Undo goes back to before the whole drag.

The arm is followed from place to place. Of the places of a drag the journal keeps the last, which also says
from which posture the arm came to it, so that it leads alone to the same session to the last digit.
"""

from dataclasses import field, replace

import numpy as np

from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.session.command import AbstractChange, AbstractCommand, computed
from workbench.session.state import Drag, Focus, Session
from workbench.session.target_postures import (
    TargetState,
    branches_to,
    follow_target,
    with_branch_name,
    with_obstacles,
)
from workbench.session.target_steps import (
    begin_step,
    check_free,
    check_unlocked,
    finish_step,
    move_targets,
    with_target,
    with_targets,
)

MAX_TARGET_DISTANCE = 10.0
"""Targets beyond this distance from the base are refused [m]."""
NOBODY = 0
"""Client of commands that no browser sent."""
Place = tuple[float, float, float]


class SelectTarget(AbstractChange):
    """Select a target; the arm moves there."""

    target: int

    title = computed(lambda self: f"Select target {self.target + 1}")

    def check(self, session: Session) -> None:
        session.check_target(self.target)
        if session.drag is not None and session.drag.target != self.target:
            check_free(session)

    def apply(self, session: Session) -> Session:
        return replace(session, selected=self.target).updated("playback", focus=Focus.TARGET)


class GrabTarget(AbstractChange):
    """Start dragging a target: nobody else can move it until it is dropped."""

    target: int
    client: int = NOBODY

    title = computed(lambda self: f"Move target {self.target + 1}")  # as undo calls the whole drag

    def check(self, session: Session) -> None:
        check_unlocked(session, self.target)
        check_free(session)

    def apply(self, session: Session) -> Session:
        begun = begin_step(session).updated("playback", focus=Focus.TARGET)
        drag = Drag(self.client, self.target, session.score.linearisation)
        return replace(begun, drag=drag, selected=self.target)


class MoveTarget(AbstractChange):
    """Move a target, in the robot's base frame: by dragging, or with typed coordinates.

    Args:
        target: Which one, counted from 0.
        xyz: Position of the tool [m].
        rpy: Its roll, pitch, yaw [rad].
        client: Who moves it: within a drag by this client the moves are one step, else each is its own.
        start: The posture from which the arm is followed; the present one if None.
    """

    target: int
    xyz: Place
    rpy: Place
    client: int = NOBODY
    start: TargetState | None = field(default=None, compare=False)

    title = computed(lambda self: f"Move target {self.target + 1}")

    key = computed(lambda self: ("move", self.target, self.client))

    def check(self, session: Session) -> None:
        check_unlocked(session, self.target)
        if not self._is_dragging(session):
            check_free(session)
        check_place(f"target {self.target + 1}", self.xyz, self.rpy)

    def apply(self, session: Session) -> Session:
        old, now = session.plate.targets[self.target], session.states[self.target]
        target = replace(old, xyz=frozen(np.array(self.xyz)), rpy=frozen(np.array(self.rpy)), q=None)
        state = follow_target(session.robot, target, self.start or now)
        plate, states = with_target(session, self.target, target, state)
        session = replace(session, selected=self.target)
        if not self._is_dragging(session):
            return move_targets(session, plate, states)
        states = with_obstacles(session.robot, plate, states, of=[self.target])  # the others' at its end
        return with_targets(session, plate, states)

    def merged_with(self, previous: AbstractCommand, session: Session) -> "MoveTarget | None":
        is_next = previous.key == self.key and self._is_dragging(session)
        return replace(self, start=session.states[self.target]) if is_next else None

    def _is_dragging(self, session: Session) -> bool:
        return session.drag == Drag(self.client, self.target)


class DropTarget(AbstractChange):
    """End a client's drag, also where it has disconnected; `back` as if nobody had dragged the target."""

    title = "Release the target"

    client: int = NOBODY
    back: bool = False

    def apply(self, session: Session) -> Session:
        if session.drag is None or session.drag.client != self.client:
            return session
        index, session = session.drag.target, replace(session, drag=None)
        if self.back:
            session = with_targets(session, session.history.done[-1].plate, session.history.done[-1].states)
        if session.history.done[-1].plate is session.plate:
            return session.updated("history", done=session.history.done[:-1])
        target = session.plate.targets[index]
        state = with_branch_name(target, session.states[index], branches_to(session.robot, target))
        return finish_step(session, session.plate, with_target(session, index, target, state)[1])


def plain(point: np.ndarray) -> Place:
    """A point, or three angles, as plain numbers."""
    x, y, z = point.tolist()
    return x, y, z


def check_place(what: str, xyz: tuple[float, ...], rpy: tuple[float, ...]) -> None:
    """Refuse a position that is not finite or too far away."""
    if not np.isfinite((*xyz, *rpy)).all():
        raise OptionError(f"the coordinates of {what} must be finite numbers")
    if (far := max(abs(v) for v in xyz)) > MAX_TARGET_DISTANCE:
        raise OptionError(f"{what} would be {far:.3g} m from the base (at most {MAX_TARGET_DISTANCE:g} m)")
