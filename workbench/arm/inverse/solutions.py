"""All joint coordinates that reach a target: completeness is decided here.

Six revolute joints and a pose, and five of them and a position with an axis (whose free turn about the tool's
z axis is a sixth), have at most sixteen solutions, and all of them follow from `elimination`. The closed loop
is entered at several joints, because a target that is degenerate for one entry is not for another. Other arms
with as many joints as conditions are searched from random starts until two rounds find nothing new.

In both cases the neighbours of nearly singular solutions are searched too, along the direction that hardly
moves the tool, because two solutions lie close together there; near a singular one elimination is inaccurate,
and more random starts compensate for it.
"""

from collections.abc import Sequence
from copy import deepcopy
from typing import no_type_check

import numpy as np
from jaxtyping import Float
from numba import njit

from workbench.arm.inverse.branch import planned_margins
from workbench.arm.inverse.branch_names import plain_names
from workbench.arm.inverse.damped_newton import Task, refine, unlimited
from workbench.arm.inverse.elimination import closure_starts
from workbench.arm.inverse.reduced_arm import ReducedArm

ENTRIES = (0, 1, 2)
"""Joints at which the loop is entered."""
RANDOM_STARTS = 48
"""Random starts per target besides the algebraic ones."""
ADDITIONAL_STARTS = 96
"""Additional ones for a target with a solution of a smaller singular value than `MIN_SAFE_SINGULAR_VALUE`."""
ROUND, ROUNDS = 192, 24
"""Random starts per round, and maximum number of rounds, for arms without elimination."""
SAME_SOLUTION = 1e-4
"""Solutions closer than this are the same [rad, or share of the arm's length]."""
NEAR_SINGULAR = 0.05
"""Dimensionless singular value below which a solution's neighbours are searched."""
MIN_SAFE_SINGULAR_VALUE = 3e-3
"""Dimensionless singular value below which algebraic starts may miss neighbours of a solution."""
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
    arm: ReducedArm,
    targets: Float[np.ndarray, "rows 4 4"],
    *,
    task: Task,
    limits: Float[np.ndarray, "n 2"],
    rng: np.random.Generator,
) -> list[np.ndarray]:
    """Every solution of every target, limits ignored; of infinitely many representatives, within the limits
    where possible."""
    if arm.dof > task:
        return [_spread(arm, target[None], task, limits, rng) for target in targets]
    rows, n = len(targets), arm.dof
    found = [np.empty((0, n))] * rows
    if not arm.slides.any() and (arm.dof, task) in ((6, Task.POSE), (5, Task.POSITION_AXIS)):
        starts = [algebraic_starts(arm, targets, ENTRIES), random_starts(arm, (rows, RANDOM_STARTS), rng)]
        found = _extend(arm, targets, found, np.concatenate(starts, 1), task)
        rng = deepcopy(rng)  # later draws don't depend on how many were needed here
        for i in range(rows):
            if (smallest_singular_value(arm, found[i], task) < MIN_SAFE_SINGULAR_VALUE).any():
                more = random_starts(arm, (1, ADDITIONAL_STARTS), rng)
                found[i] = _extend(arm, targets[i : i + 1], [found[i]], more, task)[0]
            found[i] = _with_neighbours(arm, targets[i : i + 1], found[i], task)
    else:
        for i in range(rows):
            found[i] = _searched(arm, targets[i : i + 1], task, rng)
    return [_representatives(arm, targets[i : i + 1], found[i], task, limits) for i in range(rows)]


def algebraic_starts(
    arm: ReducedArm, targets: Float[np.ndarray, "rows 4 4"], entries: Sequence[int]
) -> Float[np.ndarray, "rows starts n"]:
    """16 starts per entry from the elimination."""
    constants = arm.constants
    if arm.dof == 5:
        constants = np.concatenate([constants, np.eye(4)[None]])
    try:
        found = closure_starts(constants, targets, length=arm.length, entries=entries)
    except np.linalg.LinAlgError:  # an exactly singular pencil: the other entries suffice
        if len(entries) > 1:
            return np.concatenate([algebraic_starts(arm, targets, (entry,)) for entry in entries], axis=1)
        found = np.empty((len(targets), 0, 6))
    found = np.nan_to_num(found[:, :, : arm.dof])
    return found @ np.linalg.inv(arm.drives).T if len(arm.couplings) else found


def random_starts(
    arm: ReducedArm,
    shape: tuple[int, ...],
    rng: np.random.Generator,
    *,
    limits: Float[np.ndarray, "n 2"] | None = None,
) -> np.ndarray:
    """Uniform joint coordinates within limits; one turn, or the arm's length, for joints without limits."""
    limits = np.tile([-np.inf, np.inf], (arm.dof, 1)) if limits is None else limits
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


def _extend(
    arm: ReducedArm, targets: np.ndarray, found: list[np.ndarray], starts: np.ndarray, task: Task
) -> list[np.ndarray]:
    """Solutions so far, and the distinct new ones found from starts (rows, k, n)."""
    rows, k, n = starts.shape
    result = refine(arm, targets, starts.reshape(-1, n), task=task, target_of=np.repeat(np.arange(rows), k))
    good, x = result.converged.reshape(rows, k), result.q.reshape(rows, k, n)
    return [distinct(arm, np.concatenate([found[i], x[i, good[i]]])) for i in range(rows)]


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
        x = _extend(arm, target, [x], (part[weak] + steps).reshape(1, -1, arm.dof), task)[0]
    return x


def _searched(arm: ReducedArm, target: np.ndarray, task: Task, rng: np.random.Generator) -> np.ndarray:
    """Solutions from random starts, in rounds until two find nothing new."""
    x, idle = np.empty((0, arm.dof)), 0
    for _ in range(ROUNDS):
        before = len(x)
        x = _extend(arm, target, [x], random_starts(arm, (1, ROUND), rng), task)[0]
        x = _with_neighbours(arm, target, x, task)
        idle = idle + 1 if len(x) == before else 0
        if idle == 2 or len(x) > 200:
            break
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


def _spread(
    arm: ReducedArm, target: np.ndarray, task: Task, limits: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Representatives of infinitely many solutions, far apart, with room to the limits where any have."""
    room = np.outer(planned_margins(limits), [1.0, -1.0])
    for bounds in (limits + room, limits, limits, None):
        begin = random_starts(arm, (SPREAD_STARTS,), rng, limits=limits)
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
