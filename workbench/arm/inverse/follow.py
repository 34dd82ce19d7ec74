"""Following a target: one warm-started damped Newton run within the limits, for drags (`damped_newton`).

A deflected arm is then refined (`refine_deflected`).
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from workbench.arm.inverse.damped_newton import Reached, Task, refine
from workbench.arm.inverse.deflected_arm import refine_deflected
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.array_checks import as_pose, numbers
from workbench.base.errors import DataError, ShapeError

FOLLOW_STEPS = 40
"""Number of steps per drag event."""


def follow(
    robot: Robot,
    pose: ArrayLike,
    q_start: ArrayLike,
    *,
    task: Task | None = None,
    motion: Motion | None = None,
) -> Reached:
    """The solution next to a start, or the nearest configuration within the limits.

    Args:
        pose: Tool pose in the measuring frame, a 4×4 matrix [m]; its rotation is not checked.
        q_start: Where to start, usually the last solution [rad or m].
        task: Which part of the pose must be met; by default as much as the number of joints allows.
        motion: Drivers of the robot's effects, one row; its q is ignored.

    Raises:
        ShapeError: the pose is not a 4×4 matrix, or the start has another number of joints than the robot.
    """
    start = numbers(q_start, "joint positions to start from [rad or m]")
    if start.shape != (robot.dof,):
        raise ShapeError(
            f"robot '{robot.name}' has {robot.dof} joints, got {start.size} joint positions to start from",
            expected=robot.dof,
            found=start.size,
        )
    if not np.isfinite(start).all():
        raise DataError(f"joint positions to start from must be finite, got {start.tolist()}")
    return follow_many(robot, as_pose(pose)[None], start[None], task=task, motion=motion).row(0)


def follow_many(
    robot: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    q_starts: Float[np.ndarray, "rows n"],
    *,
    task: Task | None = None,
    motion: Motion | None = None,
) -> Reached:
    """`follow` for many targets, one row each."""
    robot.check_joints(q_starts)
    arm, task = compile_arm(robot), task or Task.default(robot.dof)
    found = refine(arm, poses, q_starts, task=task, limits=arm.limits, iterations=FOLLOW_STEPS)
    if not robot.effects:
        return found
    return refine_deflected(robot, poses, found.q, task=task, limits=arm.limits, motion=motion)
