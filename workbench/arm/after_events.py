"""The arm after all events that happened while it was measured."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from workbench.arm.effects.effect import NO_WRENCHES, AbstractEffect
from workbench.arm.effects.events import AbstractEvent, FrameStep, ToolStep
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.mounting import Mounting
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4

STEPS = (FrameStep, ToolStep)
"""Events that change base or tool, which may differ between sessions."""


def events_of(robot: Robot) -> list[AbstractEvent]:
    """Events during the measurements of an arm, in their order."""
    events = (e for e in robot.effects if isinstance(e, AbstractEvent))
    return sorted(events, key=lambda e: e.moment)


def after_events(robot: Robot, sessions: Mapping[str, Motion]) -> Robot:
    """The arm in its present state, without the events during the measurements.

    A session that ended before base or tool stepped keeps the base and the tool of its time; the present
    ones come first.

    Args:
        robot: The arm with its events.
        sessions: The rows that determine them, by session.
    """
    gone = {n for e in events_of(robot) for n in e.names}
    if not gone:
        return robot
    now = _after(robot, robot.mounting, Motion(np.zeros((1, robot.dof))))
    own, seen = {}, {}
    for name in dict.fromkeys([*robot.sessions, *sessions]):
        last = _last(robot, sessions.get(name))
        own[name] = _after(robot, robot.sessions.get(name, robot.mounting), last)
        seen[name] = sum(bool(e.is_over(last)[0]) for e in _steps(robot))
    differ = bool(robot.sessions) or not all(_same(m, now) for m in own.values())
    order = sorted(own, key=lambda n: -seen[n]) if differ else []
    record = robot.calibration
    if record is not None:
        record = replace(record, std={n: s for n, s in record.std.items() if n not in gone})
    if record is not None and (alone := record.geometry) is not None:
        mountings = {n: alone.sessions.get(n, alone.mounting) for n in order}
        record = replace(record, geometry=replace(alone, sessions=mountings))
    return replace(
        robot,
        mounting=now,
        effects=tuple(e for e in robot.effects if not e.is_event),
        sessions={n: own[n] for n in order},
        calibration=record,
    )


def is_valid_after(robot: Robot, rows: Motion, fitted: Motion | None) -> Bool[np.ndarray, " rows"]:
    """Rows of a session for which the arm of `after_events` is valid.

    Args:
        robot: The arm with its events.
        rows: Some rows of the session.
        fitted: Its rows that determine the events; None if there are none.
    """
    out, last = np.ones(len(rows), bool), _last(robot, fitted)
    for event in events_of(robot):
        out &= event.is_over(rows) == (not isinstance(event, STEPS) or bool(event.is_over(last)[0]))
    return out


def _steps(robot: Robot) -> list[AbstractEvent]:
    return [e for e in events_of(robot) if isinstance(e, STEPS)]


def _last(robot: Robot, motion: Motion | None) -> Motion:
    """The row of a session after most of the steps; one after all events without rows."""
    steps = _steps(robot)
    if motion is None or not len(motion) or not steps:
        return Motion(np.zeros((1, robot.dof)))
    latest = int(np.argmax(np.sum([e.is_over(motion) for e in steps], axis=0)))
    return replace(motion.take(slice(latest, latest + 1)), q=np.zeros((1, robot.dof)))


def _after(robot: Robot, own: Mounting, last: Motion) -> Mounting:
    """The mounting in a row."""
    acting = [e for e in _steps(robot) if e.law(robot.chain, last, NO_WRENCHES).any()]
    if not acting:
        return own
    plain = replace(robot, mounting=own, sessions={}, effects=())

    def pose(*steps: AbstractEffect) -> Matrix4:
        return tool_poses(plain.with_effects(*steps), last)[0]

    unmoved = se3.inverse(pose())
    based = pose(*(e for e in acting if isinstance(e, FrameStep))) @ unmoved
    tooled = unmoved @ pose(*(e for e in acting if isinstance(e, ToolStep)))
    return own.at(based @ own.base.pose, own.tool.pose @ tooled)


def _same(one: Mounting, other: Mounting) -> bool:
    pairs = ((one.base, other.base), (one.tool, other.tool))
    return all(np.array_equal(a.pose, b.pose) for a, b in pairs)
