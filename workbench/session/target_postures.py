"""The arm's postures at targets: solved from scratch, or followed from the previous posture.

A target is followed from its last joint positions, so that a dragged target keeps its branch as long as that
branch reaches it. If following fails, all branches are tried; if none reaches, the arm takes the nearest
posture it can and the reason is kept.

Where the arm would run into plate, blocks or table (`plate/collision.py`) an automatically chosen branch is
replaced by a collision-free one, if there is any.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import Branch, InverseResult, choose, nearest_of, quality, roomy
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.solve import follow, solve
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.progress import check_cancelled
from workbench.base.types import frozen
from workbench.plate.collision import hits, obstacles, shape_of, unobstructed
from workbench.plate.optimiser.shapes import Collider
from workbench.plate.plate import AUTO, Kind, Plate, Target
from workbench.plate.target_branches import choose_branches

TIGHT = 0.02
"""Distance from the plate [m] up to which it is told: an arm that is not calibrated may be off by as much."""


@dataclass(frozen=True, eq=False)
class TargetState:
    """The arm's posture at a target.

    Args:
        q: Joint positions: of the solution, or of the nearest that the arm comes [rad or m].
        reached: Whether the tool meets the target within the joint limits.
        branch: Name of the inverse-kinematics solution; empty where none is reached.
        reason: Why it is out of reach; empty where it is reached.
        hit: What the arm would run into there, and with which link, as far as a quick look tells.
    """

    q: Float[np.ndarray, " n"]
    reached: bool
    branch: str = ""
    reason: str = ""
    hit: str = ""

    @property
    def measurable(self) -> bool:
        """Whether the arm can stand there: the target is reached, and nothing is in the way."""
        return self.reached and not self.hit

    @property
    def obstacle(self) -> str:
        """Why the target can't be measured, in words; empty where it can."""
        if not self.reached:
            return "out of reach"
        return f"blocked ({self.hit})" if self.hit else ""


def solve_all_targets(
    robot: Robot, plate: Plate, *, region_q: Float[np.ndarray, "poses n"]
) -> tuple[TargetState, ...]:
    """The arm at every target, in the most informative mix of branches for the region.

    Args:
        robot: The arm.
        plate: Its targets; those that name a branch or joint positions keep them.
        region_q: Poses that matter [rad or m]; without any, each target takes its best branch.
    """
    plate.check_joints(robot)
    results = []
    for target in plate.targets:
        results.append(_solve(robot, target))
        check_cancelled()
    states = [_first(robot, t, r) for t, r in zip(plate.targets, results, strict=True)]
    open_ = [i for i, t in enumerate(plate.targets) if states[i].reached and t.q is None]
    if len(open_) > 1 and len(region_q):
        solutions = [_choices(robot, plate, i, results[i]) for i in open_]
        pairs = zip(open_, solutions, strict=True)
        targets = (_with_known_branch(plate.targets[i], branches) for i, branches in pairs)
        part = replace(plate, targets=tuple(targets))
        rng = np.random.default_rng(0)
        choice = choose_branches(robot, part, solutions, goal=region_q, rng=rng)
        check_cancelled()  # a mix that was cut short is no answer
        for i, q, name in zip(open_, choice.q, choice.branches, strict=True):
            states[i] = _reached(frozen(q.copy()), name)
    elif not len(region_q):
        for i in open_:
            if plate.targets[i].branch == AUTO:
                best = max(_choices(robot, plate, i, results[i]), key=quality)
                states[i] = _reached(best.q, best.name)
    return settled(robot, plate, tuple(states))


def with_obstacles(
    robot: Robot, plate: Plate, states: tuple[TargetState, ...], *, of: Iterable[int] | None = None
) -> tuple[TargetState, ...]:
    """The same states, each (or those `of` some targets) with what the arm hits on the current plate."""
    rows = [i for i in (range(len(states)) if of is None else of) if states[i].reached]
    if not rows:
        return states
    found = hits(robot, plate, rows, np.stack([states[i].q for i in rows]))
    now = list(states)
    for i, hit in zip(rows, found, strict=True):
        now[i] = states[i] if hit == states[i].hit else replace(states[i], hit=hit)
    return tuple(now)


def settled(robot: Robot, plate: Plate, states: tuple[TargetState, ...]) -> tuple[TargetState, ...]:
    """The same, and where the arm is blocked in a branch of the program's, in the nearest clear one."""
    free = list(with_obstacles(robot, plate, states))
    for i, (target, state) in enumerate(zip(plate.targets, free, strict=True)):
        if state.reached and state.hit and target.branch == AUTO and target.q is None:
            branch = nearest_of(unobstructed(robot, plate, i, branches_to(robot, target)), state.q)
            free[i] = state if branch is None else _reached(branch.q, branch.name)
    return tuple(free)


def clearance(robot: Robot, plate: Plate, q: Float[np.ndarray, " n"]) -> str:
    """By how much the moving links clear plate and table, in words; empty without any."""
    found, shape = obstacles(robot, plate, ()), shape_of(robot)
    at, bodies = shape.placements(q[None]), shape.bodies
    links = range(2, robot.dof)  # the first one turns about its own axis

    def gap(solid: Collider, *some: int) -> float:
        return shape.hull_distances(at, [solid], checked=np.isin(bodies, some))[0]

    if not found or not links:
        return ""
    gaps = {name: gap(solid, *links) for name, solid in found.items()}
    what = min(gaps, key=gaps.__getitem__)
    if gaps[what] >= TIGHT:
        return f"the arm clears {' and '.join(found)} by {1e3 * TIGHT:.0f} mm or more"
    link = min(links, key=lambda k: gap(found[what], k))
    return f"link {link} clears {what} by {1e3 * gaps[what]:.0f} mm"


def branches_to(robot: Robot, target: Target) -> tuple[Branch, ...]:
    """All branches within limits that reach a target."""
    return _solve(robot, target).within_limits


def place(robot: Robot, target: Target, near: Float[np.ndarray, " n"]) -> TargetState:
    """The arm at a target, solved from scratch: in its named branch, or else in the one nearest to `near`."""
    return _state(_solve(robot, target), near=near, branch=target.branch)


def follow_target(robot: Robot, target: Target, before: TargetState) -> TargetState:
    """The arm at a target that has moved a little, in the same branch if that reaches it.

    A branch that was chosen by hand is kept: where it does not reach, the target is out of reach.
    """
    followed = follow(robot, robot.base.pose @ target.pose, before.q, task=_task(robot, target))
    if followed.converged and before.reached:
        return _reached(followed.q, before.branch)
    near = followed.q if followed.converged else before.q
    return place(robot, target, near)


def with_branch_name(target: Target, before: TargetState, branches: tuple[Branch, ...]) -> TargetState:
    """The same posture under the name of its branch, which may have changed during the drag."""
    if not before.reached or target.branch != AUTO:
        return before
    branch = nearest_of(branches, before.q)
    return before if branch is None or branch.name == before.branch else replace(before, branch=branch.name)


def _first(robot: Robot, target: Target, result: InverseResult) -> TargetState:
    if target.q is None:
        target = _with_known_branch(target, result.within_limits)
        return _state(result, branch=target.branch)
    return follow_target(robot, target, TargetState(target.q, True, target.branch))


def _reached(q: Float[np.ndarray, " n"], branch: str) -> TargetState:
    return TargetState(frozen(q), True, branch)


def _choices(robot: Robot, plate: Plate, number: int, result: InverseResult) -> tuple[Branch, ...]:
    """The branch chosen by hand, or those with room that keep clear of the plate; all, where none does."""
    within = result.within_limits
    if plate.targets[number].branch in result.names:
        return within
    return roomy(unobstructed(robot, plate, number, within)) or within


def _state(
    result: InverseResult, *, near: Float[np.ndarray, " n"] | None = None, branch: str = AUTO
) -> TargetState:
    try:
        chosen = choose(result, near=near, branch=branch)
    except OptionError:  # a named branch that the target does not have any more
        chosen = None
    if chosen is not None and chosen.within_limits:
        return _reached(chosen.q, chosen.name)
    nearest = result.nearest
    others = len(result.within_limits)
    reason = result.reason or f"the chosen branch '{branch}' does not reach it; {others} others do"
    return TargetState(frozen(nearest.q), False, reason=reason)


def _with_known_branch(target: Target, branches: tuple[Branch, ...]) -> Target:
    """A branch that the target does not have within limits is left to the program."""
    known = target.branch == AUTO or any(b.name == target.branch for b in branches)
    return target if known else replace(target, branch=AUTO)


@lru_cache(maxsize=256)
def _solve(robot: Robot, target: Target) -> InverseResult:
    """Asked for again whenever a plate is placed anew of which one target has moved."""
    return solve(robot, robot.base.pose @ target.pose, task=_task(robot, target))


def _task(robot: Robot, target: Target) -> Task | None:
    return None if target.kind is Kind.SEAT else Task.POSITION
