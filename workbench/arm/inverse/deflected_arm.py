"""Joint coordinates with which a deflecting arm reaches its targets.

The target of the rigid arm T(q) is offset by the deflection of the deflected one B(q): with D(q) = T(q)
B(q)⁻¹ the deflected arm is at the target T* exactly where the rigid one is at D(q) T*. From a solution for
the rigid arm

    q ← q + s (T⁻¹(D(q) T*) − q)

is repeated, T⁻¹ the warm-started Newton run within the limits, s = 1 and halved while the error does not
decrease. An arm deflects by milliradians, so each round gains about three digits, also near singularities.

If a load changes sign within a joint's play (backlash by moment), no joint position may hold the target: the
run then ends at the nearest pose, with the remaining error; infinite where the arm can't hold its load.

The branches of a deflecting arm: those of its geometry, corrected so that it meets the target.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float

from workbench.arm import chain as chains
from workbench.arm.inverse import unreachable
from workbench.arm.inverse.branch import LIMIT_SLACK, Branch, InverseResult, Nearest, margins, quality
from workbench.arm.inverse.damped_newton import ROTATION_WEIGHT, Refined, Task, refine, unlimited
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect
from workbench.base import se3
from workbench.base.types import frozen


def deflected_result(
    robot: Robot,
    target: Float[np.ndarray, "4 4"],
    rigid: InverseResult,
    limits: Float[np.ndarray, "n 2"],
    motion: Motion | None,
) -> InverseResult:
    """Every solution of a deflected arm at a pose, from those of the rigid one.

    Args:
        target: Tool pose in the measuring frame [m].
        rigid: Solutions of the geometry alone.
        limits: Limits of the joints [rad or m].
        motion: What drives the effects beside q, one row.
    """
    if not rigid.branches:
        return rigid
    q = np.stack([b.q for b in rigid.branches])
    rows = np.zeros(len(rigid.branches), np.int64)
    state = None if motion is None else motion.take(rows)
    found = refine_deflected(
        robot, target[None][rows], q, task=rigid.task, limits=unlimited(robot.dof), motion=state
    )
    moved = found.x[:, compile_arm(robot).places]
    branches = sorted(
        (_at(b, row, limits) for b, row in zip(rigid.branches, moved, strict=True)),
        key=lambda b: (not b.within_limits, -b.manipulability),
    )
    explain = partial(_explain, robot, rigid, tuple(branches), found, limits)
    return replace(rigid, branches=tuple(branches), explain=explain)


def _explain(
    robot: Robot, rigid: InverseResult, branches: tuple[Branch, ...], found: Refined, limits: np.ndarray
) -> tuple[str | None, Nearest]:
    inside = [b for b in branches if b.within_limits]
    if inside:
        return None, _nearest(max(inside, key=quality), rigid.branches, found)
    if not rigid.reachable:
        return rigid.reason, rigid.nearest
    arm = compile_arm(robot)
    x = np.stack([b.q for b in branches])[:, arm.columns]
    return unreachable.limits_reason(arm, x, limits[arm.columns]), rigid.nearest


def _at(branch: Branch, q: np.ndarray, limits: np.ndarray) -> Branch:
    margin = float(margins(q[None], limits).min())
    return replace(branch, q=frozen(q), margin=margin, within_limits=margin >= -LIMIT_SLACK)


def _nearest(best: Branch, branches: tuple[Branch, ...], found: Refined) -> Nearest:
    """The best branch, with the deflected arm's remaining error."""
    row = [b.name for b in branches].index(best.name)
    return Nearest(best.q, float(found.position_error[row]), float(found.rotation_error[row]))


MAX_ROUNDS = 40
"""Maximum number of rounds."""
MIN_STEP_SHARE = 2.0**-8
"""Minimum step length; below it a row is given up."""
NO_ERROR = 1e-12
"""Error [m] that counts as zero."""


def refine_deflected(
    robot: Robot,
    poses: Float[np.ndarray, "rows 4 4"],
    q: Float[np.ndarray, "rows n"],
    *,
    task: Task,
    limits: Float[np.ndarray, "n 2"],
    motion: Motion | None = None,
) -> Refined:
    """Joint coordinates of the deflected arm next to those of the rigid one.

    Args:
        poses: Tool poses in the measuring frame, one per row.
        q: Where to start: solutions of the geometry alone [rad or m].
        task: Which part of the pose must be met.
        limits: Joint limits.
        motion: Drivers of the effects; its q is ignored.

    Returns:
        Final state of each row, in the chain's order, with the deflected arm's errors.
    """
    arm = compile_arm(robot)
    bounds = limits[arm.columns]
    x = np.clip(q[:, arm.columns], bounds[:, 0], bounds[:, 1])
    weight = ROTATION_WEIGHT * arm.length
    best, step = x.copy(), np.zeros_like(x)
    errors, cost = np.full((len(x), 2), np.inf), np.full(len(x), np.inf)
    share, steps, going = np.ones(len(x)), np.zeros(len(x), np.int64), np.arange(len(x))
    for _ in range(MAX_ROUNDS):
        if not len(going):
            break
        now = x[going][:, arm.places]
        state = Motion(now) if motion is None else motion.take(going).at(now)
        wanted = rigid_targets(robot, poses[going], state)
        here = refine(arm, wanted, x[going], task=task, limits=bounds, iterations=0)
        fell = here.cost(weight) < cost[going]
        lower = going[fell]
        best[lower], cost[lower] = x[lower], here.cost(weight)[fell]
        errors[lower] = np.stack([here.position_error, here.rotation_error], 1)[fell]
        there = refine(arm, wanted[fell], x[lower], task=task, limits=bounds)
        step[lower], steps[lower] = there.x - x[lower], steps[lower] + there.steps
        share[going] = np.where(fell, 1.0, 0.5 * share[going])
        x[going] = best[going] + share[going][:, None] * step[going]
        going = going[(cost[going] > NO_ERROR**2) & (share[going] > MIN_STEP_SHARE)]
    return Refined(best, errors[:, 0], errors[:, 1], steps)


def rigid_targets(
    robot: Robot, poses: Float[np.ndarray, "rows 4 4"], state: Motion
) -> Float[np.ndarray, "rows 4 4"]:
    """Targets for the rigid arm that bring the deflected one to the poses, with this state's deflection."""
    rigid = chains.poses(robot.chain, state.q)
    deflected = chains.poses(robot.chain, state.q, shift=deflect(robot, state).shift)
    return rigid @ se3.inverse(deflected) @ poses
