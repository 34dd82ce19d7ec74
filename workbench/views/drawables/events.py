"""What happened while the rows were measured: an arrow where base or tool stepped, and words."""

from collections.abc import Iterator

import numpy as np

from workbench.arm.effects.events import AbstractEvent, ToolStep
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Vector3
from workbench.session.commands.arm import drawn_joints
from workbench.session.state import Focus, Session
from workbench.views.appearance.bodies import body_frames
from workbench.views.appearance.colours import EVENT
from workbench.views.drawables.drawable import Arrows, Label
from workbench.views.drawables.sink import Item

ABOVE = 0.04
"""Height of the words over their place [m]; those of each further event stand so much higher."""
ARROW_DISTANCE = 0.15
"""Distance from the base's axis at which its arrow begins, beside the body, in reaches."""
THICK = 3.0


def happened(session: Session) -> Iterator[Item]:
    """An arrow by which the base or the tool stepped, and what it was."""
    found, focus = session.results.diagnosis, session.playback.focus
    is_shown = session.choices.overlay.points and focus in (Focus.ROW, Focus.JOG)
    if found is None:
        return
    for k, event in enumerate(found.events):
        base = found.calibrated.base.rotation  # seen by the instrument, as base and tool were found
        inputs = session.robot, drawn_joints(session), event, base, session.choices.overlay.exaggeration, k
        yield Item(f"event/arrow/{k + 1}", lambda *of: _drawn(*of)[0], inputs, shown=is_shown)
        yield Item(f"event/words/{k + 1}", lambda *of: _drawn(*of)[1], inputs, shown=is_shown)


def place_and_step(
    robot: Robot, q: np.ndarray, event: AbstractEvent, base: np.ndarray
) -> tuple[Vector3, Vector3]:
    """Where an event is seen, and by how much it moved there, in the base's frame [m].

    Args:
        robot: The arm as it is drawn.
        q: Its posture.
        event: What happened.
        base: Orientation of the base in the measuring frame.
    """
    if isinstance(event, ToolStep):
        tool = se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(q[None]))[0]
        return tool[:3, 3], tool[:3, :3] @ robot.tool.rotation.T @ np.array(event.coefficients[:3])
    if event.joints:
        return body_frames(robot, q)[event.joints[0] + 1, :3, 3], np.zeros(3)
    return np.zeros(3), base.T @ np.array(event.coefficients[:3])


def _drawn(
    robot: Robot, q: np.ndarray, event: AbstractEvent, base: np.ndarray, times: float, number: int
) -> tuple[Arrows | None, Label]:
    """Its arrow, none of a joint's, and words above the arrow's end."""
    place, step = place_and_step(robot, q, event, base)
    if step.any() and not isinstance(event, ToolStep):
        place = place + ARROW_DISTANCE * robot.reach * step / np.linalg.norm(step)
    end = place + times * step
    arrow = None if event.joints else Arrows(starts=place[None], ends=end[None], colour=EVENT, thick=THICK)
    return arrow, Label(text=event.mark, place=end + np.array([0.0, 0.0, ABOVE * (number + 1)]))
