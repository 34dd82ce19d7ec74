"""What keeps an instrument from seeing the tool: distance, and the direction into which its target looks.

A reflector that is fixed to the tool is seen while the line of sight comes in within a cone about the
direction that it looks in; the thesis lost its laser tracker's beam beyond 45° (Katana §3.3). Optical
systems have a nearest and a farthest distance.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.types import Vector3, frozen

CLEARANCE, HEIGHT = 2.2, 1.0
"""Where an instrument stands if nothing else is said: so far beyond the arm's reach along the base's x axis,
and so high over the base [m]."""
SIDES = frozen(np.concatenate([np.eye(3), -np.eye(3)]))
"""Directions of the tool frame into which a target may be mounted to look."""
SIDE_NAMES = ("+x", "+y", "+z", "−x", "−y", "−z")


@dataclass(frozen=True, kw_only=True)
class Sight:
    """Limits of sight.

    Args:
        near: Least distance [m].
        far: Greatest distance [m].
        cone: Greatest angle between the line of sight and the direction that the target looks in [rad]; None
            for targets that are seen from all sides or turned to the instrument.
    """

    near: float = 0.0
    far: float = np.inf
    cone: float | None = None


def station(robot: Robot) -> Vector3:
    """Where an instrument stands in the measuring frame if nothing else is said [m]."""
    return robot.base.pose[:3, :3] @ np.array([CLEARANCE + robot.reach, 0.0, HEIGHT]) + robot.base.xyz


def mounting(sight: Sight, poses: Float[np.ndarray, "rows 4 4"], place: Vector3) -> int:
    """The side of the tool, as in `SIDES`, on which a target is seen in most poses."""
    return int(np.argmax((_angles(poses, place) <= (sight.cone or np.pi)).sum(axis=0)))


def lost(sight: Sight, poses: Float[np.ndarray, "rows 4 4"], place: Vector3) -> tuple[np.ndarray, str]:
    """Why each pose is not seen, "" where it is, and how the target was mounted.

    Args:
        sight: Limits of the instrument.
        poses: Of the tool, in the measuring frame.
        place: Where the instrument stands in it [m].
    """
    reasons = np.full(len(poses), "", dtype="<U80")
    away = np.linalg.norm(poses[:, :3, 3] - place, axis=1)
    for i in np.flatnonzero((away < sight.near) | (away > sight.far)):
        reasons[i] = f"{away[i]:.2f} m from the instrument, which sees {sight.near:g} to {sight.far:g} m"
    if sight.cone is None or not len(poses):
        return reasons, ""
    side = mounting(sight, poses, place)
    angles = np.rad2deg(_angles(poses, place)[:, side])
    limit = float(np.rad2deg(sight.cone))
    for i in np.flatnonzero((angles > limit) & (reasons == "")):
        reasons[i] = f"{angles[i]:.0f}° off the line of sight, more than {limit:.0f}°"
    return reasons, f"the target looks along {SIDE_NAMES[side]} of the tool, where most poses are seen"


def _angles(poses: Float[np.ndarray, "rows 4 4"], place: Vector3) -> Float[np.ndarray, "rows sides"]:
    """Angle between the line of sight and each side of the tool."""
    towards = place - poses[:, :3, 3]
    towards = towards / np.maximum(np.linalg.norm(towards, axis=1, keepdims=True), 1e-12)
    return np.arccos(np.clip(np.einsum("rij,sj,ri->rs", poses[:, :3, :3], SIDES, towards), -1.0, 1.0))
