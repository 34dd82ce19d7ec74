"""All joint coordinates that reach a target: completeness is decided here.

A table of random configurations has the tool's pose of each. Those whose poses are nearest to the target
start damped Newton runs, in every branch: they find each of up to sixteen solutions of six joints that
algebraic elimination does, in the same time (9 006 of 9 006 on fourteen arms), and no structure enters. The
neighbours of nearly singular solutions are searched too, along the direction that hardly moves the tool,
because two solutions lie close together there.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from workbench.arm.inverse.branch import margins, planned_margins, representative
from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT, Task, refine, unlimited
from workbench.arm.inverse.reduced_arm import ReducedArm

TABLE_SIZE = 20_000
"""Number of configurations in the table of an arm and a task."""
STARTS = 192
"""Starts per target."""
SAME_SOLUTION = 1e-4
"""Solutions closer than this are the same [rad, or share of the arm's length]."""
NEAR_SINGULAR = 0.05
"""Dimensionless singular value below which a solution's neighbours are searched."""
SINGULAR_VALUE = 1e-6
"""Dimensionless singular value below which a solution may be one of infinitely many."""
SEARCH_DISTANCES = (0.03, 0.15, 0.6)
"""Search distance from a nearly singular solution [rad]."""
MAX_REPRESENTATIVES = 8
"""Maximum number of solutions shown of infinitely many."""


def all_solutions(
    arm: ReducedArm, targets: Float[np.ndarray, "rows 4 4"], *, task: Task, limits: Float[np.ndarray, "n 2"]
) -> list[np.ndarray]:
    """Every solution of every target, limits ignored; a few of infinitely many, those of a redundant arm
    within the limits."""
    is_redundant = arm.dof > task
    starts = nearby_starts(arm, targets, task, STARTS, is_limited=is_redundant)
    found = _extend(arm, targets, starts, task, limits if is_redundant else None)
    each = [target[None] for target in targets]
    if not is_redundant:
        found = [_with_neighbours(arm, target, x, task) for target, x in zip(each, found, strict=True)]
    return [_representatives(arm, *one, task, limits) for one in zip(each, found, strict=True)]


def nearby_starts(
    arm: ReducedArm,
    targets: Float[np.ndarray, "rows 4 4"],
    task: Task,
    count: int,
    *,
    is_limited: bool = False,
) -> Float[np.ndarray, "rows count n"]:
    """Configurations of the table whose tools are nearest to each target, within the arm's limits or not."""
    x, tree = _table(arm, task, is_limited)
    return x[tree.query(_features(targets, arm, task), k=count)[1]]


@lru_cache(maxsize=16)
def _table(arm: ReducedArm, task: Task, is_limited: bool) -> tuple[np.ndarray, cKDTree]:
    limits = arm.limits if is_limited else unlimited(arm.dof)
    x = random_starts(arm, (TABLE_SIZE,), np.random.default_rng(0), limits)
    return x, cKDTree(_features(arm.geometry(x)[0], arm, task))


def _features(poses: np.ndarray, arm: ReducedArm, task: Task) -> np.ndarray:
    """Features whose distance measures how far apart two poses are."""
    scale = ROTATION_WEIGHT * arm.length
    parts = [poses[:, :3, 3]]
    if task is not Task.POSITION:
        parts.append(scale * poses[:, :3, 2])
    if task is Task.POSE:
        parts.append(scale * poses[:, :3, 0])
    return np.concatenate(parts, 1)


def random_starts(
    arm: ReducedArm, shape: tuple[int, ...], rng: np.random.Generator, limits: Float[np.ndarray, "n 2"]
) -> np.ndarray:
    """Uniform joint coordinates within limits; one turn, or the arm's length, for joints without limits."""
    span = np.where(arm.sliding, arm.length, np.pi)
    low = np.where(np.isfinite(limits[:, 0]), limits[:, 0], np.minimum(-span, limits[:, 1] - 2 * span))
    high = np.where(np.isfinite(limits[:, 1]), limits[:, 1], np.maximum(low + 2 * span, span))
    return rng.uniform(low, high, (*shape, arm.dof))


def task_jacobian(
    arm: ReducedArm, x: Float[np.ndarray, "rows n"], task: Task
) -> Float[np.ndarray, "rows m n"]:
    """The rows of the Jacobian required by the task; rotations about the tool's z axis projected out."""
    jacobian = arm.jacobian(x)
    if task is Task.POSITION:
        return jacobian[:, :3]
    if task is Task.POSITION_AXIS:
        tool = arm.geometry(x)[0][:, :, :2]  # x and y axes of the tool: rotations about them matter
        return np.concatenate([jacobian[:, :3], np.swapaxes(tool, 1, 2) @ jacobian[:, 3:]], 1)
    return jacobian


def _extend(
    arm: ReducedArm, targets: np.ndarray, starts: np.ndarray, task: Task, limits: np.ndarray | None = None
) -> list[np.ndarray]:
    """The distinct solutions found from starts (rows, k, n)."""
    rows, k, n = starts.shape
    owner = np.repeat(np.arange(rows), k)
    result = refine(arm, targets, starts.reshape(-1, n), task=task, target_of=owner, limits=limits)
    good, x = result.converged.reshape(rows, k), result.q.reshape(rows, k, n)
    return [distinct(arm, x[i, good[i]]) for i in range(rows)]


def _with_neighbours(arm: ReducedArm, target: np.ndarray, x: np.ndarray, task: Task) -> np.ndarray:
    """Solutions, and those near the nearly singular ones."""
    checked = 0
    while checked < len(x):
        part = x[checked:]
        checked = len(x)
        _, s, vt = np.linalg.svd(task_jacobian(arm, part, task))
        weak = (s[:, -1] < NEAR_SINGULAR) & (s[:, -1] > SINGULAR_VALUE)
        if not weak.any() or len(x) > 64:
            break
        steps = np.array([*SEARCH_DISTANCES, *(-r for r in SEARCH_DISTANCES)])[:, None, None] * vt[weak, -1]
        more = _extend(arm, target, (part[weak] + steps).reshape(1, -1, arm.dof), task)[0]
        x = distinct(arm, np.concatenate([x, more]))
    return x


def _representatives(
    arm: ReducedArm, target: np.ndarray, x: np.ndarray, task: Task, limits: np.ndarray
) -> np.ndarray:
    """Solutions, and of infinitely many some that are far apart, within the limits where any can be."""
    is_one_of_many = (smallest_singular_value(arm, x, task) < SINGULAR_VALUE) | (arm.dof > task)
    rest, room = x[is_one_of_many], planned_margins(limits)
    if arm.dof <= task:  # a redundant arm's have been sought there
        for bounds in (limits, limits + np.outer(room, [1.0, -1.0])):
            moved = refine(arm, target, rest, task=task, limits=bounds)
            rest = np.where(moved.converged[:, None], moved.q, rest)
        rest, room = distinct(arm, rest), 0.0 * room
    gaps = margins(representative(rest, limits, ~arm.repeats), limits)
    within = ((gaps >= least - SAME_SOLUTION).all(1) for least in (room, 0.0 * room))
    rest = next((rest[holds] for holds in within if holds.any()), rest)
    size = smallest_singular_value(arm, rest, task)
    place = _place(arm, rest)
    picked = [int(np.argmax(size))] if len(rest) else []
    while len(picked) < min(MAX_REPRESENTATIVES, len(rest)):
        away = np.linalg.norm(place[:, None] - place[picked], axis=2).min(1)
        picked.append(int(np.argmax(away)))
    return np.concatenate([x[~is_one_of_many], rest[picked]])


def smallest_singular_value(
    arm: ReducedArm, x: Float[np.ndarray, "rows n"], task: Task
) -> Float[np.ndarray, " rows"]:
    """Smallest singular value of the task's Jacobian, dimensionless."""
    return np.linalg.svd(task_jacobian(arm, x, task), compute_uv=False)[:, -1]


def distinct(arm: ReducedArm, x: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "kept n"]:
    """The first of every group of solutions that agree up to full turns."""
    place = _place(arm, x)
    square = (place**2).sum(1)
    is_same = square[:, None] + square - 2.0 * place @ place.T < SAME_SOLUTION**2
    return x[~np.tril(is_same, -1).any(1)]


def _place(arm: ReducedArm, x: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows 2*n"]:
    """Configurations as points: the same one after full turns, lengths in units of the arm's."""
    plain = np.where(arm.sliding, x / arm.length, x)
    turned = np.concatenate([np.cos(x), np.sin(x)], 1)
    return np.where(np.tile(arm.repeats, 2), turned, np.concatenate([plain, 0.0 * plain], 1))
