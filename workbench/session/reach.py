"""How the arm stands at targets: solved from nothing, or followed from where it stood before.

A target is followed from its last joint positions, so that a dragged target keeps its branch as long as
that branch reaches it. Where following fails, all branches are tried; where none reaches, the arm stands as
near as it comes and the reason is kept.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.design.branches import choose_branches
from workbench.design.plate import AUTO, Kind, Plate, Target
from workbench.errors import OptionError
from workbench.model.inverse import follow, solve
from workbench.model.newton import Task
from workbench.model.ways import InverseResult, choose, nearest_branch
from workbench.robots.robot import Robot
from workbench.session.state import TargetState
from workbench.types import Matrix4, frozen

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
    states = [_first(robot, t, r) for t, r in zip(plate.targets, results, strict=True)]
    open_ = [i for i, t in enumerate(plate.targets) if states[i].reached and t.q is None]
    if len(open_) > 1 and len(region_q):
        part = replace(plate, targets=tuple(_with_known_branch(plate.targets[i], results[i]) for i in open_))
        solutions = [results[i].within_limits for i in open_]
        choice = choose_branches(robot, part, solutions, goal=region_q, rng=rng, starts=STARTS)
        for i, q, name in zip(open_, choice.q, choice.branches, strict=True):
            states[i] = TargetState(frozen(q.copy()), True, name)
    return tuple(states)


def advance(robot: Robot, target: Target, before: TargetState) -> TargetState:
    """The arm at a target that has moved a little, in the same branch if that reaches it."""
    followed = follow(robot, _in_measuring_frame(robot, target), before.q, task=_task(robot, target))
    if followed.converged and before.reached:
        return TargetState(frozen(followed.q), True, before.branch)
    return _state(_solve(robot, target), near=followed.q if followed.converged else before.q)


def settle(robot: Robot, target: Target, before: TargetState) -> TargetState:
    """The same posture under its right name, which may have changed on the way."""
    if not before.reached:
        return before
    branch = nearest_branch(_solve(robot, target), before.q)
    return before if branch is None else replace(before, branch=branch.name)


def _first(robot: Robot, target: Target, result: InverseResult) -> TargetState:
    if target.q is None:
        return _state(result, branch=target.branch)
    return advance(robot, target, TargetState(target.q, True, target.branch))


def _state(
    result: InverseResult, *, near: Float[np.ndarray, " n"] | None = None, branch: str = AUTO
) -> TargetState:
    try:
        chosen = choose(result, near=near, branch=branch)
    except OptionError:  # a named branch that the target does not have any more
        chosen = choose(result, near=near)
    if chosen is not None and chosen.within_limits:
        return TargetState(frozen(chosen.q), True, chosen.name)
    nearest = result.nearest
    missing = (nearest.position_error, nearest.rotation_error)
    return TargetState(frozen(nearest.q), False, reason=result.reason or "", missing=missing)


def _with_known_branch(target: Target, result: InverseResult) -> Target:
    """A branch that the target does not have within limits is left to the program."""
    known = target.branch == AUTO or any(b.name == target.branch for b in result.within_limits)
    return target if known else replace(target, branch=AUTO)


def _solve(robot: Robot, target: Target) -> InverseResult:
    return solve(robot, _in_measuring_frame(robot, target), task=_task(robot, target))


def _task(robot: Robot, target: Target) -> Task | None:
    return None if target.kind is Kind.SEAT else Task.POSITION


def _in_measuring_frame(robot: Robot, target: Target) -> Matrix4:
    return robot.base.pose @ target.pose
