"""How the arm stands at targets: solved from nothing, or followed from where it stood before.

A target is followed from its last joint positions, so that a dragged target keeps its branch as long as
that branch reaches it. Where following fails, all branches are tried; where none reaches, the arm stands as
near as it comes and the reason is kept.

Whether an arm keeps clear of plate and blocks is a quick look at its axis lines, not a full check: the lines
between neighbouring link frames are sampled, but for the last one, which carries the probe to the target. A
sample is too close when it lies over the plate's solid, or over a block, and lower than the arm is thick.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.branch import Branch
from workbench.arm.inverse.branches import InverseResult, choose, nearest_of
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.solve import follow, solve
from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.cancel import Cancel, Cancelled, never
from workbench.base.errors import OptionError
from workbench.base.types import Matrix4, frozen
from workbench.plate.branches import choose_branches
from workbench.plate.plate import AUTO, Kind, Plate, Target
from workbench.session.state import TargetState

STARTS = 8
"""Random mixes from which the first branches are improved."""


def place_all(
    robot: Robot,
    plate: Plate,
    *,
    region_q: Float[np.ndarray, "poses n"],
    rng: np.random.Generator,
    cancel: Cancel = never,
) -> tuple[TargetState, ...]:
    """The arm at every target, in the mix of branches that tells most about the region.

    Args:
        robot: The arm.
        plate: Its targets; those that name a branch or joint positions keep them.
        region_q: Poses that matter [rad or m]; without any, each target takes its best branch.
        rng: Source of the mixes that are tried.
        cancel: Asked at each target whether to stop.

    Raises:
        Cancelled: asked to stop.
    """
    results = []
    for target in plate.targets:
        results.append(_solve(robot, target))
        if cancel():
            raise Cancelled
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
    reason = result.reason or f"the chosen branch '{branch}' does not reach it; {others} others do"
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


THICKNESS = 0.03
"""Radius of an arm, as a share of its reach."""
BLOCK = 0.026
"""Half the width of a target's block at its foot [m]."""
SAMPLES = 8
"""Points looked at on each line."""


def is_clear(robot: Robot, plate: Plate, q: Float[np.ndarray, "rows n"]) -> Bool[np.ndarray, " rows"]:
    """Which postures keep the arm above plate and blocks, wherever it is over them; all without a solid."""
    if plate.size is None:
        return np.ones(len(q), bool)
    points, radius = _points(robot, plate, q), THICKNESS * robot.reach
    return ~(_in_plate(plate, points, radius) | _in_blocks(plate, points, radius).any(-1)).any((1, 2))


def first_hit(robot: Robot, plate: Plate, q: Float[np.ndarray, " n"]) -> str:
    """What the arm would run into, and with which link, in words; empty if it keeps clear."""
    if plate.size is None:
        return ""
    points, radius = _points(robot, plate, q[None])[0], THICKNESS * robot.reach
    if (links := _in_plate(plate, points, radius).any(1)).any():
        return f"link {int(links.argmax()) + 2} would run into the plate"
    blocks = _in_blocks(plate, points, radius).any(1)
    if blocks.any():
        link, block = np.argwhere(blocks)[0]
        return f"link {link + 2} would run into the block of target {block + 1}"
    return ""


def _points(robot: Robot, plate: Plate, q: np.ndarray) -> Float[np.ndarray, "rows links samples 3"]:
    """Points along the arm, in the plate's frame."""
    places = se3.inverse(robot.base.pose @ plate.pose) @ link_frames(robot, Motion(q))[:, :-1]
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    start, end = places[:, :-2, None, :3, 3], places[:, 1:-1, None, :3, 3]
    return start + share * (end - start)


def _in_plate(plate: Plate, points: Float[np.ndarray, "*lead 3"], radius: float) -> Bool[np.ndarray, "*lead"]:
    assert plate.size is not None
    over = (np.abs(points[..., :2]) < 0.5 * plate.size[:2] + radius).all(-1)
    return over & (points[..., 2] < radius)


def _in_blocks(plate: Plate, points: Float[np.ndarray, "*lead 3"], radius: float):
    """Which points are inside which block, last axis: a cylinder from the plate to each target."""
    places = se3.apply(se3.inverse(plate.pose), plate.poses[:, :3, 3])
    apart = np.linalg.norm(points[..., None, :2] - places[:, :2], axis=-1)
    return (apart < BLOCK + 0.5 * radius) & (points[..., None, 2] < places[:, 2] + 0.5 * radius)
