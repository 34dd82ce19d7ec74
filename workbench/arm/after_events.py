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
    frames = {s.name: s for s in robot.sessions}
    if motion is not None:
        for name, mine in (sessions or {}).items():
            if (own := _frames_of(robot, name, motion.take(mine))) is not None:
                frames[name] = own
    record = robot.calibration
    if record is not None:
        record = replace(record, std={n: s for n, s in record.std.items() if n not in gone})
    left = tuple(e for e in robot.effects if not e.is_event)
    return replace(robot, effects=left, sessions=tuple(frames.values()), calibration=record)


def _frames_of(robot: Robot, session: str, motion: Motion) -> SessionFrames | None:
    """Frames of a session in whose rows some steps were all to come; None if none were."""
    to_come = [
        e for e in robot.effects if isinstance(e, FrameStep | ToolStep) and not e.is_over(motion).any()
    ]
    if not to_come:
        return None
    frames = robot.session_frames(session)
    plain = replace(robot.in_session(session), effects=())

    def pose(*steps: AbstractEffect) -> Matrix4:
        return tool_poses(plain.with_effects(*steps), motion.take(slice(1)))[0]

    now = se3.inverse(pose())
    based = pose(*(e for e in to_come if isinstance(e, FrameStep))) @ now
    tooled = now @ pose(*(e for e in to_come if isinstance(e, ToolStep)))
    return replace(
        frames,
        base=_at(frames.base, based @ frames.base.pose),
        tool=_at(frames.tool, frames.tool.pose @ tooled),
    )


def _at(frame: Frame, pose: Matrix4) -> Frame:
    return replace(frame, xyz=pose[:3, 3].copy(), rotation=pose[:3, :3].copy())
