"""Inverse kinematics: every branch that reaches a pose, the reason if there is none, and fast following.

`solve` finds all solution branches where there are finitely many, for any geometry (`solutions`), names them
(`branches`) and explains failure (`unreachable`). `follow` is one warm-started damped Newton run within the
limits, for drags (`damped_newton`). Nothing here assumes a nominal structure, so a calibrated arm is solved
exactly.

A deflected arm (`Robot.effects`) has the branches of its geometry, each refined so that the deflected arm
reaches the target (`refine_deflected`); reasons, and nearest configurations, are the geometry's. A branch
keeps its turn: with an effect that does not repeat every turn, use `follow` from another one.
"""

from copy import deepcopy
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from workbench.arm.inverse import unreachable
from workbench.arm.inverse.branch import (
    LIMIT_SLACK,
    Branch,
    InverseResult,
    Nearest,
    choose,
    margins,
    nearest_branch,
    quality,
    representative,
)
from workbench.arm.inverse.branch_names import branch_names
from workbench.arm.inverse.damped_newton import Task, refine
from workbench.arm.inverse.deflected_arm import deflected_result
from workbench.arm.inverse.follow import Followed, FollowedMany, follow, follow_many
from workbench.arm.inverse.reduced_arm import ReducedArm, compile_arm
from workbench.arm.inverse.solutions import (
    SINGULAR_VALUE,
    Solutions,
    all_solutions,
    distinct,
    random_starts,
    smallest_singular_value,
)
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.array_checks import as_pose, check_rotations, numbers
from workbench.base.errors import DataError, ShapeError
from workbench.base.types import frozen

__all__ = [
    "Branch",
    "Followed",
    "FollowedMany",
    "InverseResult",
    "Nearest",
    "Task",
    "choose",
    "follow",
    "follow_many",
    "nearest_branch",
    "solve",
    "solve_many",
]

MAX_REPRESENTATIVES = 8
"""Maximum number of solutions shown for a redundant arm."""
SPREAD_STARTS = 96
"""Random starts for these, per round."""


def solve(
    robot: Robot,
    pose: ArrayLike,
    *,
    task: Task | None = None,
    rng: np.random.Generator | None = None,
    limits: ArrayLike | None = None,
    motion: Motion | None = None,
) -> InverseResult:
    """Every branch that reaches a pose of the tool.

    Args:
        pose: Tool pose in the measuring frame, a 4×4 matrix [m].
        task: Which part must be met; by default as much as the number of joints allows.
        rng: For the random starts in addition to the algebraic ones; seeded with 0 if None.
        limits: Limits to use instead of the robot's [rad or m]; infinite to ignore limits.
        motion: Drivers of the robot's effects, one row; its q is ignored.

    Raises:
        DataError: the pose is not finite or not a rigid motion, or an effect lacks its driver.
        ShapeError: the pose is not a 4×4 matrix, or limits have another number of joints than the robot.
    """
    return solve_many(robot, as_pose(pose)[None], task=task, rng=rng, limits=limits, motion=motion)[0]


def solve_many(
    robot: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    *,
    task: Task | None = None,
    rng: np.random.Generator | None = None,
    limits: ArrayLike | None = None,
    motion: Motion | None = None,
) -> list[InverseResult]:
    """`solve` for several poses at once, at less than half the time each; `motion` has one row per pose."""
    arm, task = compile_arm(robot), task or Task.default(robot.dof)
    rng = np.random.default_rng(0) if rng is None else rng
    targets, limits = check_poses(poses), _limits(robot, limits)
    inner = limits[arm.columns]
    if arm.dof > task:
        solutions = [_spread(arm, t[None], task, inner, rng) for t in targets]
    else:
        solutions = all_solutions(arm, targets, task=task, rng=rng)
    later = deepcopy(rng)  # for `explain`, whatever the order of use
    results = [_result(arm, t, s, task, limits, later) for t, s in zip(targets, solutions, strict=True)]
    if not robot.effects:
        return results
    states = [None if motion is None else motion.take(np.array([i])) for i in range(len(results))]
    return [
        deflected_result(robot, t, r, limits, s) for t, r, s in zip(targets, results, states, strict=True)
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


def _spread(
    arm: ReducedArm, target: np.ndarray, task: Task, limits: np.ndarray, rng: np.random.Generator
) -> Solutions:
    """Representatives of infinitely many solutions within the limits, far apart from each other."""
    x = np.empty((0, arm.dof))
    for bounds in (limits, limits, limits, None):
        starts = random_starts(arm, (SPREAD_STARTS,), rng, limits=limits)
        one = np.zeros(len(starts), np.int64)
        r = refine(arm, target, starts, task=task, target_of=one, limits=bounds)
        x = distinct(arm, r.x[r.converged])
        if len(x):
            break
    if len(x):
        place = np.concatenate([np.where(arm.slides, x, np.cos(x)), np.where(arm.slides, 0.0, np.sin(x))], 1)
        picked = [int(np.argmax(smallest_singular_value(arm, x, task)))]
        away = np.linalg.norm(place - place[picked[0]], axis=1)
        while len(picked) < min(MAX_REPRESENTATIVES, len(x)):
            picked.append(int(np.argmax(away)))
            away = np.minimum(away, np.linalg.norm(place - place[picked[-1]], axis=1))
        x = x[picked]
    return Solutions(x, smallest_singular_value(arm, x, task))


def _result(
    arm: ReducedArm,
    target: np.ndarray,
    solutions: Solutions,
    task: Task,
    limits: np.ndarray,
    rng: np.random.Generator,
) -> InverseResult:
    inner = limits[arm.columns]
    x = representative(solutions.x, inner, arm.slides)
    x = _into_limits(arm, target, x, solutions, task, inner)
    names = [f"sample {i + 1}" for i in range(len(x))] if arm.dof > task else branch_names(arm, x)
    branches = _branches(arm, x, names, solutions.smallest, limits)
    explain = partial(_explain, arm, target, x, branches, task, inner, rng)
    return InverseResult(branches, task, explain)


def _explain(
    arm: ReducedArm,
    target: np.ndarray,
    x: np.ndarray,
    branches: tuple[Branch, ...],
    task: Task,
    limits: np.ndarray,
    rng: np.random.Generator,
) -> tuple[str | None, Nearest]:
    """Why no branch is within the limits, and the nearest configuration."""
    reason = None
    inside = [b for b in branches if b.within_limits]
    if inside:
        best = max(inside, key=quality)
        closest = refine(arm, target[None], best.q[None, arm.columns], task=task, iterations=0)
    else:
        rng = deepcopy(rng)
        closest = unreachable.nearest(arm, target, task=task, limits=limits, rng=rng, starts=x)
        if len(x):
            reason = unreachable.limits_reason(arm, x, limits)
        else:
            reason = unreachable.geometry_reason(arm, target, task=task, limits=limits, rng=rng)
    nearest = Nearest(
        frozen(closest.x[0, arm.places]), float(closest.position_error[0]), float(closest.rotation_error[0])
    )
    return reason, nearest


def _into_limits(
    arm: ReducedArm, target: np.ndarray, x: np.ndarray, solutions: Solutions, task: Task, limits: np.ndarray
) -> np.ndarray:
    """Move representatives of infinitely many solutions into the limits where possible."""
    outside = (solutions.smallest < SINGULAR_VALUE) & (margins(x, limits).min(1, initial=np.inf) < 0.0)
    if not outside.any():
        return x
    one = np.zeros(int(outside.sum()), np.int64)
    r = refine(arm, target[None], x[outside], task=task, target_of=one, limits=limits)
    x = x.copy()
    x[np.flatnonzero(outside)[r.converged]] = r.x[r.converged]
    return x


def _branches(
    arm: ReducedArm, x: np.ndarray, names: list[str], smallest: np.ndarray, limits: np.ndarray
) -> tuple[Branch, ...]:
    slides = frozen(arm.slides[arm.places])
    branches = []
    for row, name, manipulability in zip(x[:, arm.places], names, smallest.tolist(), strict=True):
        margin = float(margins(row[None], limits).min())
        branches.append(
            Branch(
                q=frozen(row.copy()),
                name=name,
                within_limits=margin >= -LIMIT_SLACK,
                margin=margin,
                manipulability=manipulability,
                limits=limits,
                slides=slides,
            )
        )
    return tuple(sorted(branches, key=lambda b: (not b.within_limits, -b.manipulability)))
