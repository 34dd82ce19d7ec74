"""All joint coordinates that reach a target: completeness is decided here.

A table of random configurations has the tool's pose of each. Those whose poses are nearest to the target
start damped Newton runs, in every branch: they find each of up to sixteen solutions of six joints that
algebraic elimination does, in less time (9 006 of 9 006 on fourteen arms), and no structure enters. The
neighbours of nearly singular solutions are searched too, along the direction that hardly moves the tool,
because two solutions lie close together there.
"""

from functools import lru_cache
from typing import no_type_check

import numpy as np
from jaxtyping import Float
from numba import njit
from scipy.spatial import cKDTree

from workbench.arm.inverse.branch import planned_margins
from workbench.arm.inverse.branch_names import plain_names
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
SAME_SINGULAR = 0.03
"""Singular solutions closer than this are the same, as merging solutions are ill-conditioned [rad]."""
SEARCH_DISTANCES = (0.03, 0.15, 0.6)
"""Search distance from a nearly singular solution [rad]."""
MAX_REPRESENTATIVES = 8
"""Maximum number of solutions shown for a redundant arm."""
SPREAD_STARTS = 96
"""Random starts for these, per round."""


def all_solutions(
    arm: ReducedArm, targets: Float[np.ndarray, "rows 4 4"], *, task: Task, limits: Float[np.ndarray, "n 2"]
) -> list[np.ndarray]:
    """Every solution of every target, limits ignored; of infinitely many representatives, within the limits
    where possible."""
    each = [target[None] for target in targets]
    if arm.dof > task:
        return [_spread(arm, target, task, limits) for target in each]
    found = _extend(arm, targets, nearby_starts(arm, targets, task, STARTS), task)
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
    span = np.where(arm.slides, arm.length, np.pi)
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


def _extend(arm: ReducedArm, targets: np.ndarray, starts: np.ndarray, task: Task) -> list[np.ndarray]:
    """The distinct solutions found from starts (rows, k, n)."""
    rows, k, n = starts.shape
    result = refine(arm, targets, starts.reshape(-1, n), task=task, target_of=np.repeat(np.arange(rows), k))
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
    """Solutions, and of infinitely many at a singular pose one for each name: within the limits if it can be,
    and with a joint at zero, the last one that can turn."""
    singular = smallest_singular_value(arm, x, task) < SINGULAR_VALUE
    rest, found = x[singular], [np.empty((0, arm.dof))]
    still = [np.where(np.arange(arm.dof)[:, None] == k, 0.0, limits) for k in reversed(range(arm.dof))]
    for bounds in (*still, limits, unlimited(arm.dof)):
        r = refine(arm, target, rest, task=task, limits=bounds)
        held = r.converged & (smallest_singular_value(arm, r.q, task) < 10 * SINGULAR_VALUE)
        found.append(r.q[held])
        rest = rest[~held]
    merged = distinct(arm, np.concatenate([*found, rest]), SAME_SINGULAR)
    merged = merged[np.argsort(np.abs(merged).sum(1), kind="stable")]
    first = np.unique(np.array(plain_names(arm, merged), str), return_index=True)[1]
    return np.concatenate([x[~singular], merged[np.sort(first)]])


def _spread(arm: ReducedArm, target: np.ndarray, task: Task, limits: np.ndarray) -> np.ndarray:
    """Representatives of infinitely many solutions, far apart, with room to the limits where any have."""
    rng = np.random.default_rng(0)
    room = np.outer(planned_margins(limits), [1.0, -1.0])
    for bounds in (limits + room, limits, limits, None):
        begin = random_starts(arm, (SPREAD_STARTS,), rng, limits)
        r = refine(arm, target, begin, task=task, limits=bounds)
        if len(x := distinct(arm, r.q[r.converged])):
            break
    place = np.concatenate([np.where(arm.slides, x, np.cos(x)), np.where(arm.slides, 0.0, np.sin(x))], 1)
    picked = [int(np.argmax(smallest_singular_value(arm, x, task)))] if len(x) else []
    while len(picked) < min(MAX_REPRESENTATIVES, len(x)):
        away = np.linalg.norm(place[:, None] - place[picked], axis=2).min(1)
        picked.append(int(np.argmax(away)))
    return x[picked]


def smallest_singular_value(
    arm: ReducedArm, x: Float[np.ndarray, "rows n"], task: Task
) -> Float[np.ndarray, " rows"]:
    """Smallest singular value of the task's Jacobian, dimensionless."""
    return np.linalg.svd(task_jacobian(arm, x, task), compute_uv=False)[:, -1]


def distinct(
    arm: ReducedArm, x: Float[np.ndarray, "rows n"], tolerance: float = SAME_SOLUTION
) -> Float[np.ndarray, "kept n"]:
    """The first of every group of solutions that agree up to full turns."""
    unit = np.where(arm.slides, arm.length, 1.0)
    return x[_first_of_group(np.ascontiguousarray(x / unit), ~arm.repeats, tolerance)]


@njit(cache=True)
@no_type_check
def _first_of_group(x, slides, tolerance):
    kept = np.empty(x.shape[0], np.int64)
    count = 0
    for i in range(x.shape[0]):
        new = True
        for j in range(count):
            same = True
            for k in range(x.shape[1]):
                gap = x[i, k] - x[kept[j], k]
                if not slides[k]:
                    gap -= 2.0 * np.pi * np.round(gap / (2.0 * np.pi))
                if abs(gap) > tolerance:
                    same = False
                    break
            if same:
                new = False
                break
        if new:
            kept[count] = i
            count += 1
    return kept[:count]
