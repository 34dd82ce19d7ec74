"""How the arm stands at targets: solved from nothing, or followed from where it stood before.

A target is followed from its last joint positions, so that a dragged target keeps its branch as long as
that branch reaches it. Where following fails, all branches are tried; where none reaches, the arm stands as
near as it comes and the reason is kept.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse.branch import Branch
from workbench.arm.inverse.branches import InverseResult, choose, nearest_of
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.solve import follow, solve
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, frozen
from workbench.plate.branches import choose_branches
from workbench.plate.plate import (
    AUTO,
    Kind,
    Plate,
    Target,
)
from workbench.session.clearance import first_hit, is_clear
from workbench.session.state import TargetState

STARTS = 8
"""Random mixes from which the first branches are improved."""


def place_all(
    robot: Robot, plate: Plate, *, region_q: Float[np.ndarray, "poses n"], rng: np.random.Generator
) -> tuple[TargetState, ...]:
    """The arm at every target, in the mix of branches that tells most about the region.

    Args:
        robot: The arm.
        plate: Its targets; those that name a branch or joint positions keep them.
        region_q: Poses that matter [rad or m]; without any, each target takes its best branch.
        rng: Source of the mixes that are tried.
    """
    results = [_solve(robot, target) for target in plate.targets]
    states = [_first(robot, plate, t, r) for t, r in zip(plate.targets, results, strict=True)]
    open_ = [i for i, t in enumerate(plate.targets) if states[i].reached and t.q is None]
    if len(open_) > 1 and len(region_q):
        solutions = [_choices(robot, plate, plate.targets[i], results[i]) for i in open_]
        targets = (
            _with_known_branch(plate.targets[i], ways) for i, ways in zip(open_, solutions, strict=True)
        )
        part = replace(plate, targets=tuple(targets))
        choice = choose_branches(robot, part, solutions, goal=region_q, rng=rng, starts=STARTS)
        for i, q, name in zip(open_, choice.q, choice.branches, strict=True):
            states[i] = _reached(robot, plate, frozen(q.copy()), name)
    return tuple(states)


def branches_to(robot: Robot, target: Target) -> tuple[Branch, ...]:
    """All branches within limits that reach a target."""
    return _solve(robot, target).within_limits


def place(robot: Robot, plate: Plate, target: Target, near: Float[np.ndarray, " n"]) -> TargetState:
    """The arm at a target from nothing: in its named branch, or else in the one nearest to `near`."""
    return _state(robot, plate, _solve(robot, target), near=near, branch=target.branch)


def advance(robot: Robot, plate: Plate, target: Target, before: TargetState) -> TargetState:
    """The arm at a target that has moved a little, in the same branch if that reaches it.

    A branch that was chosen by hand is kept: where it does not reach, the target is out of reach.
    """
    followed = follow(robot, _in_measuring_frame(robot, target), before.q, task=_task(robot, target))
    if followed.converged and before.reached:
        return _reached(robot, plate, followed.q, before.branch)
    near = followed.q if followed.converged else before.q
    return place(robot, plate, target, near)


def settle(target: Target, before: TargetState, ways: tuple[Branch, ...]) -> TargetState:
    """The same posture under its right name of all that reach the target; it may have changed on the way."""
    if not before.reached or target.branch != AUTO:
        return before
    branch = nearest_of(ways, before.q)
    return before if branch is None or branch.name == before.branch else replace(before, branch=branch.name)


def _first(robot: Robot, plate: Plate, target: Target, result: InverseResult) -> TargetState:
    if target.q is None:
        target = _with_known_branch(target, result.within_limits)
        return _state(robot, plate, result, branch=target.branch)
    return advance(robot, plate, target, TargetState(target.q, True, target.branch))


def _reached(robot: Robot, plate: Plate, q: Float[np.ndarray, " n"], branch: str) -> TargetState:
    return TargetState(frozen(q), True, branch, hit=first_hit(robot, plate, q))


def _choices(robot: Robot, plate: Plate, target: Target, result: InverseResult) -> tuple[Branch, ...]:
    """The branch chosen by hand, or those that keep clear of the plate; all, where none does."""
    within = result.within_limits
    if target.branch in result.names:
        return within
    clear = is_clear(robot, plate, np.stack([b.q for b in within]))
    return tuple(b for b, c in zip(within, clear, strict=True) if c) or within


def _state(
    robot: Robot,
    plate: Plate,
    result: InverseResult,
    *,
    near: Float[np.ndarray, " n"] | None = None,
    branch: str = AUTO,
) -> TargetState:
    try:
        chosen = choose(result, near=near, branch=branch)
    except OptionError:  # a named branch that the target does not have any more
        chosen = None
    if chosen is not None and chosen.within_limits:
        return _reached(robot, plate, chosen.q, chosen.name)
    nearest = result.nearest
    missing = (nearest.position_error, nearest.rotation_error)
    others = len(result.within_limits)
    reason = result.reason or f"the chosen branch '{branch}' does not get here, {others} others do"
    return TargetState(frozen(nearest.q), False, reason=reason, missing=missing)


def _with_known_branch(target: Target, ways: tuple[Branch, ...]) -> Target:
    """A branch that the target does not have within limits is left to the program."""
    known = target.branch == AUTO or any(b.name == target.branch for b in ways)
    return target if known else replace(target, branch=AUTO)


def _solve(robot: Robot, target: Target) -> InverseResult:
    return solve(robot, _in_measuring_frame(robot, target), task=_task(robot, target))


def _task(robot: Robot, target: Target) -> Task | None:
    return None if target.kind is Kind.SEAT else Task.POSITION


def _in_measuring_frame(robot: Robot, target: Target) -> Matrix4:
    return robot.base.pose @ target.pose
