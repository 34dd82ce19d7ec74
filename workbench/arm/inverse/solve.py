"""Inverse kinematics: every branch that reaches a pose, the reason if there is none, and fast following.

`solve` finds all solution branches where there are finitely many, for any geometry (`solutions`), and names
them (`branch_names`). `follow`, in a module of its own, is one warm-started damped Newton run within the
limits, for drags (`damped_newton`). Nothing here assumes a nominal structure, so a calibrated arm is solved
exactly.

A deflected arm (`Robot.effects`) has the branches of its geometry, each refined so that the deflected arm
reaches the target (`refine_deflected`); nearest configurations are the geometry's. A branch keeps its turn:
with an effect that does not repeat every turn, use `follow` from another one.

Where no branch is within the limits, the nearest posture minimises |p* − p|² + w² |ρ|² (`damped_newton`).
"""

from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from workbench.arm.inverse.branch import (
    LIMIT_SLACK,
    Branch,
    InverseResult,
    choose,
    margins,
    nearest_branch,
    quality,
    representative,
)
from workbench.arm.inverse.branch_names import branch_names
from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT, Reached, Task, refine, unlimited
from workbench.arm.inverse.follow import follow, follow_many, refine_deflected
from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.inverse.solutions import STARTS, all_solutions, nearby_starts, smallest_singular_value
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.array_checks import as_pose, check_rotations, numbers
from workbench.base.errors import DataError, ShapeError
from workbench.base.types import frozen

__all__ = [
    "Branch",
    "InverseResult",
    "Reached",
    "Task",
    "choose",
    "follow",
    "follow_many",
    "nearest_branch",
    "solve",
    "solve_many",
]


def solve(
    robot: Robot,
    pose: ArrayLike,
    *,
    task: Task | None = None,
    limits: ArrayLike | None = None,
    motion: Motion | None = None,
) -> InverseResult:
    """Every branch that reaches a pose of the tool.

    Args:
        pose: Tool pose in the measuring frame, a 4×4 matrix [m].
        task: Which part must be met; by default as much as the number of joints allows.
        limits: Limits to use instead of the robot's [rad or m]; infinite to ignore limits.
        motion: Drivers of the robot's effects, one row; its q is ignored.

    Raises:
        DataError: the pose is not finite or not a rigid motion, or an effect lacks its driver.
        ShapeError: the pose is not a 4×4 matrix, or limits have another number of joints than the robot.
    """
    return solve_many(robot, as_pose(pose)[None], task=task, limits=limits, motion=motion)[0]


def solve_many(
    robot: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    *,
    task: Task | None = None,
    limits: ArrayLike | None = None,
    motion: Motion | None = None,
) -> list[InverseResult]:
    """`solve` for several poses at once, at less than half the time each; `motion` has one row per pose."""
    arm, task = compile_arm(robot), task or Task.default(robot.dof)
    targets, limits = check_poses(poses), _limits(robot, limits)
    solutions = all_solutions(arm, targets, task=task, limits=limits)
    states = [None if motion is None else motion.take(np.array([i])) for i in range(len(targets))]
    return [
        _result(robot, target, x, task=task, limits=limits, motion=state)
        for target, x, state in zip(targets, solutions, states, strict=True)
    ]


def check_poses(poses: Float[np.ndarray, "rows 4 4"]) -> Float[np.ndarray, "rows 4 4"]:
    """Poses with exactly orthonormal rotations."""
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise ShapeError(f"a pose is a 4×4 matrix, not {poses.shape[1:]}", expected=4, found=poses.shape[-1])
    if not np.isfinite(poses).all():
        raise DataError("a target pose has entries that are not finite numbers; correct it")
    check_rotations(poses[:, :3, :3], "rotation parts of poses")
    u, _, vt = np.linalg.svd(poses[:, :3, :3])
    clean = np.array(poses, float)
    clean[:, :3, :3] = u @ vt
    return clean


def _limits(robot: Robot, limits: ArrayLike | None) -> np.ndarray:
    if limits is None:
        return robot.limits
    limits = numbers(limits, "limits [rad or m]")
    if limits.shape != (robot.dof, 2):
        raise ShapeError(
            f"limits have shape {limits.shape}; '{robot.name}' has {robot.dof} joints: give a pair for each",
            expected=robot.dof,
            found=len(limits) if limits.ndim else 0,
        )
    wrong = ~(limits[:, 0] <= limits[:, 1])  # NaN is wrong, too
    if wrong.any():
        joint = int(np.argmax(wrong))
        raise DataError(
            f"limits of joint {joint + 1} must be the lower and the upper one, got {limits[joint].tolist()}",
            joint=joint,
            found=limits[joint],
        )
    return limits


def _result(
    robot: Robot, target: np.ndarray, x: np.ndarray, *, task: Task, limits: np.ndarray, motion: Motion | None
) -> InverseResult:
    """The branches of a target, from the solutions of the geometry alone."""
    arm = compile_arm(robot)
    manipulability = smallest_singular_value(arm, x, task).tolist()
    q = representative(x, limits, ~arm.repeats)
    names = [f"sample {i + 1}" for i in range(len(q))] if arm.dof > task else branch_names(arm, q)
    if robot.effects and len(q):
        rows = np.zeros(len(q), np.int64)
        state = None if motion is None else motion.take(rows)
        free = unlimited(arm.dof)
        q = refine_deflected(robot, target[None][rows], q, task=task, limits=free, motion=state).q
    room = margins(q, limits).min(1, initial=np.inf).tolist()
    branches = tuple(
        Branch(
            q=frozen(row.copy()),
            name=name,
            within_limits=margin >= -LIMIT_SLACK,
            margin=margin,
            manipulability=size,
            limits=limits,
            slides=frozen(~arm.repeats),
        )
        for row, name, margin, size in zip(q, names, room, manipulability, strict=True)
    )
    branches = tuple(sorted(branches, key=lambda b: (not b.within_limits, -b.manipulability)))
    return InverseResult(branches, task, partial(_nearest, arm, target, branches, task, limits))


def _nearest(
    arm: ReducedArm, target: np.ndarray, branches: tuple[Branch, ...], task: Task, limits: np.ndarray
) -> Reached:
    """The best branch within the limits, or the posture there that is nearest to the target."""
    if inside := [b for b in branches if b.within_limits]:
        return Reached(max(inside, key=quality).q, np.zeros(()), np.zeros(()))
    starts = np.array([*(b.q for b in branches), *nearby_starts(arm, target[None], task, STARTS)[0]])
    found = refine(arm, target[None], starts, task=task, limits=limits, iterations=200)
    return found.row(int(np.argmin(found.cost(ROTATION_WEIGHT * arm.length))))
