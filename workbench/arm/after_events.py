"""The arm as it is after everything that happened while it was measured."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.effects.events import FrameStep, ToolStep
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Frame, Robot, SessionFrames
from workbench.base import se3
from workbench.base.types import Matrix4


def after_events(
    robot: Robot,
    motion: Motion | None = None,
    sessions: Mapping[str, Bool[np.ndarray, " rows"]] | None = None,
) -> Robot:
    """The arm as it is now, without what happened while it was measured.

    A session that was over before base or tool stepped has the base and the tool of its time.

    Args:
        robot: The arm with its events.
        motion: The rows from which they are known.
        sessions: Which of these rows are of each session.
    """
    gone = {n for e in robot.effects if e.is_event for n in e.names}
    if not gone:
        return robot
    rows = {} if motion is None else {s: motion.take(mine) for s, mine in (sessions or {}).items()}
    now = _frames_of(robot, SessionFrames("", robot.base, robot.tool))
    known = {s.name for s in robot.sessions}
    own = (_frames_of(robot, robot.session_frames(s), rows.get(s)) for s in dict.fromkeys([*known, *rows]))
    record = robot.calibration
    if record is not None:
        record = replace(record, std={n: s for n, s in record.std.items() if n not in gone})
    return replace(
        robot,
        base=now.base,
        tool=now.tool,
        effects=tuple(e for e in robot.effects if not e.is_event),
        sessions=tuple(f for f in own if f.name in known or not _same(f, now)),
        calibration=record,
    )


def _frames_of(robot: Robot, frames: SessionFrames, motion: Motion | None = None) -> SessionFrames:
    """Frames of a session as they were in the last of its rows; as they are now if none are given."""
    steps = [e for e in robot.effects if isinstance(e, FrameStep | ToolStep)]
    last = Motion(np.zeros((1, robot.dof)))
    if motion is not None and steps:
        latest = int(np.argmax(np.sum([e.is_over(motion) for e in steps], axis=0)))
        last = replace(motion.take(slice(latest, latest + 1)), q=last.q)
    acting = [e for e in steps if e.law(robot.chain, last, None).any()]
    if not acting:
        return frames
    plain = replace(robot.in_session(frames.name), effects=())

    def pose(*steps: AbstractEffect) -> Matrix4:
        return tool_poses(plain.with_effects(*steps), last)[0]

    unmoved = se3.inverse(pose())
    based = pose(*(e for e in acting if isinstance(e, FrameStep))) @ unmoved
    tooled = unmoved @ pose(*(e for e in acting if isinstance(e, ToolStep)))
    return replace(
        frames,
        base=_at(frames.base, based @ frames.base.pose),
        tool=_at(frames.tool, frames.tool.pose @ tooled),
    )


def _at(frame: Frame, pose: Matrix4) -> Frame:
    return replace(frame, xyz=pose[:3, 3].copy(), rotation=pose[:3, :3].copy())


def _same(one: SessionFrames, other: SessionFrames) -> bool:
    pairs = ((one.base, other.base), (one.tool, other.tool))
    return all(np.array_equal(a.pose, b.pose) for a, b in pairs)
