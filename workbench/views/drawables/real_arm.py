"""The real arm as far as it is known, bent away from its model by what the model is off, times a factor."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.chain import NO_SHIFT
from workbench.arm.kinematics.skeleton import body_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect
from workbench.arm.usable_arm import divided
from workbench.base import se3
from workbench.base.types import Matrix4
from workbench.session.state import Session

MAX_IDLE = 0.1
"""Largest drawn turn that leaves the tool where it is [rad]."""


def bending_robot(session: Session) -> Robot | None:
    """The arm whose effects bend it: the shown fit, or else the opened one; None without effects."""
    for robot in (session.results.calibrated, session.robot):
        if robot is not None and robot.effects:
            return driven_by_pose(robot)
    return None


@lru_cache(maxsize=8)
def driven_by_pose(robot: Robot) -> Robot | None:
    """The robot with those of its effects that need nothing but the pose; None without any."""
    kept, _ = divided(robot)
    return robot.with_effects(*kept) if kept else None


def bent_frames(
    model: Robot,
    real: Robot,
    q: Float[np.ndarray, "rows n"],
    times: float,
    *,
    gap: Float[np.ndarray, "rows 3"] | None = None,
    base: Matrix4 | None = None,
) -> Float[np.ndarray, "rows bodies 4 4"]:
    """Frames of the real arm's bodies in the frame of the base, so many times farther from the model's.

    Every link turns at its joint by what the two arms differ there, times the factor, so that the arm holds
    together. What of the tool's way these turns don't tell, as of a longer link, the least further turns do.
    Turns that leave the tool where it is, which rows hardly tell, are drawn up to `MAX_IDLE`.

    Args:
        model: The arm as it is expected.
        real: What is known of the actual one.
        q: Joint positions [rad or m].
        times: The factor.
        gap: From where the model puts the tool to where it was measured, along the base's axes [m]; NaN where
            it was not; None: nowhere. There, the two arms differ by this way.
        base: Of both arms in the measuring frame, as rows don't tell base and arm apart; None: each its own.
    """
    expected, actual = (_standing(robot, q, base) for robot in (model, real))
    tool, places = expected[:, -1, :3, 3], expected[:, 1:-1, :3, 3]
    steps, real_steps = (se3.inverse(f[:, :-1]) @ f[:, 1:] for f in (expected, actual))
    joints = steps[:, :-1, :3, :3]
    turns = se3.matrix_to_rotvec(np.swapaxes(joints, 2, 3) @ real_steps[:, :-1, :3, :3])
    way = actual[:, -1, :3, 3] - tool
    way = way if gap is None else np.where(np.isfinite(gap), gap, way)
    moves = se3.skew(places - tool[:, None]) @ expected[:, 1:-1, :3, :3]
    moves = np.concatenate(np.moveaxis(moves, 1, 0), axis=2)
    to_turns, known = np.linalg.pinv(moves), turns.reshape(len(q), -1, 1)
    idle = known - to_turns @ (moves @ known)
    idle *= np.minimum(1.0, MAX_IDLE / (times * np.abs(idle).max((1, 2), keepdims=True, initial=1e-12)))
    turns = (to_turns @ way[..., None] + idle).reshape(turns.shape)
    bent = expected[:, :-1].copy()
    for k in range(turns.shape[1]):
        turned = se3.pose(se3.rotvec_to_matrix(times * turns[:, k]), np.zeros((len(q), 3)))
        bent[:, k + 1] = bent[:, k] @ steps[:, k] @ turned
    return bent


def _standing(robot: Robot, q: Float[np.ndarray, "rows n"], base: Matrix4 | None) -> np.ndarray:
    """Frames of bodies and tool, with the effects that need nothing but the pose."""
    arm = driven_by_pose(robot) or robot.with_effects()
    shift = np.nan_to_num(deflect(arm, Motion(q)).shift) if arm.effects else NO_SHIFT
    tool = se3.inverse(arm.base.pose) @ chains.poses(arm.chain, q, shift=shift)
    frames = np.concatenate([body_frames(arm, q, shift=shift), tool[:, None]], axis=1)
    return frames if base is None else se3.inverse(base) @ arm.base.pose @ frames
