"""The arm after all events that happened while it was measured."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.effects.events import FrameStep, ToolStep
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.mounting import Mounting
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4


def after_events(
    robot: Robot,
    motion: Motion | None = None,
    sessions: Mapping[str, Bool[np.ndarray, " rows"]] | None = None,
) -> Robot:
    """The arm in its present state, without the events during the measurements.

    A session that ended before base or tool stepped keeps the base and the tool of its time.

    Args:
        robot: The arm with its events.
        motion: The rows that determine them.
        sessions: Rows of each session.
    """
    gone = {n for e in robot.effects if e.is_event for n in e.names}
    if not gone:
        return robot
    rows = {} if motion is None else {s: motion.take(mine) for s, mine in (sessions or {}).items()}
    now = _after(robot, robot.mounting)
    own = {
        name: _after(robot, robot.sessions.get(name, robot.mounting), rows.get(name))
        for name in dict.fromkeys([*robot.sessions, *rows])
    }
    record = robot.calibration
    if record is not None:
        record = replace(record, std={n: s for n, s in record.std.items() if n not in gone})
    return replace(
        robot,
        mounting=now,
        effects=tuple(e for e in robot.effects if not e.is_event),
        sessions={n: m for n, m in own.items() if n in robot.sessions or not _same(m, now)},
        calibration=record,
    )


def _after(robot: Robot, own: Mounting, motion: Motion | None = None) -> Mounting:
    """The mounting at the last of its rows; the present one without rows."""
    steps = [e for e in robot.effects if isinstance(e, FrameStep | ToolStep)]
    last = Motion(np.zeros((1, robot.dof)))
    if motion is not None and steps:
        latest = int(np.argmax(np.sum([e.is_over(motion) for e in steps], axis=0)))
        last = replace(motion.take(slice(latest, latest + 1)), q=last.q)
    acting = [e for e in steps if e.law(robot.chain, last, None).any()]
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
