"""Following a target: one warm-started damped Newton run within the limits, for drags (`damped_newton`).

The target of the rigid arm T(q) is offset by the deflection of the deflected one B(q): with D(q) = T(q)
B(q)⁻¹ the deflected arm is at the target T* exactly where the rigid one is at D(q) T*. From a solution for
the rigid arm

    q ← q + s (T⁻¹(D(q) T*) − q)

is repeated, T⁻¹ the warm-started Newton run within the limits, s = 1 and halved while the error does not
decrease. An arm deflects by milliradians, so each round gains about three digits, also near singularities.

If a load changes sign within a joint's play (backlash by moment), no joint position may hold the target: the
run then ends at the nearest pose, with the remaining error; infinite where the arm can't hold its load.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from workbench.arm import chain as chains
from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT, Reached, Task, refine
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect
from workbench.base import se3
from workbench.base.array_checks import as_pose, numbers
from workbench.base.errors import DataError

FOLLOW_STEPS = 40
"""Number of steps per drag event."""
MAX_ROUNDS = 40
"""Maximum number of rounds."""
MIN_STEP_SHARE = 2.0**-8
"""Minimum step length; below it a row is given up."""
NO_ERROR = 1e-12
"""Error [m] that counts as zero."""


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
    robot.check_joints(start[None], "joint positions to start from")
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


def refine_deflected(
    robot: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    q: Float[np.ndarray, "rows n"],
    *,
    task: Task,
    limits: Float[np.ndarray, "n 2"],
    motion: Motion | None = None,
) -> Reached:
    """Joint coordinates of the deflected arm next to those of the rigid one.

    Args:
        poses: Tool poses in the measuring frame, one per row.
        q: Where to start: solutions of the geometry alone [rad or m].
        task: Which part of the pose must be met.
        limits: Joint limits.
        motion: Drivers of the effects; its q is ignored.

    Returns:
        Final state of each row, with the deflected arm's errors.
    """
    arm = compile_arm(robot)
    x = np.clip(q, limits[:, 0], limits[:, 1])
    weight = ROTATION_WEIGHT * arm.length
    best, step = x.copy(), np.zeros_like(x)
    errors, cost = np.full((len(x), 2), np.inf), np.full(len(x), np.inf)
    share, going = np.ones(len(x)), np.arange(len(x))
    for _ in range(MAX_ROUNDS):
        if not len(going):
            break
        now = x[going]
        state = Motion(now) if motion is None else motion.take(going).at(now)
        wanted = rigid_targets(robot, poses[going], state)
        here = refine(arm, wanted, now, task=task, limits=limits, iterations=0)
        fell = here.cost(weight) < cost[going]
        lower = going[fell]
        best[lower], cost[lower] = x[lower], here.cost(weight)[fell]
        errors[lower] = np.stack([here.position_error, here.rotation_error], 1)[fell]
        step[lower] = refine(arm, wanted[fell], x[lower], task=task, limits=limits).q - x[lower]
        share[going] = np.where(fell, 1.0, 0.5 * share[going])
        x[going] = best[going] + share[going][:, None] * step[going]
        going = going[(cost[going] > NO_ERROR**2) & (share[going] > MIN_STEP_SHARE)]
    return Reached(best, errors[:, 0], errors[:, 1])


def rigid_targets(
    robot: Robot, poses: Float[np.ndarray, "rows 4 4"], state: Motion
) -> Float[np.ndarray, "rows 4 4"]:
    """Targets for the rigid arm that bring the deflected one to the poses, with this state's deflection."""
    rigid = chains.poses(robot.chain, state.q)
    deflected = chains.poses(robot.chain, state.q, shift=deflect(robot, state).shift)
    return rigid @ se3.inverse(deflected) @ poses
