"""Joint positions at which many actual arms have their tools at the actual targets.

Newton steps lead all arms at once from the nominal arm's posture to their own. Where an arm's errors put that
posture beyond its reach or its limits, they start again from the nominal arm's other branches, the nearest
first, as an operator would.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm import chain as chains
from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import TURN
from workbench.arm.kinematics.forward import joint_elements
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.arm.statics.deflection import shift_of
from workbench.base import se3

MAX_NEWTON_STEPS = 15
"""Maximum number of Newton steps."""
BENDINGS = 5
"""After so many steps the arms move too little to be deflected otherwise."""
STRIDE = 0.3
"""Maximum change of a joint in one step [rad or m]."""
ARRIVED = 1e-9
"""The steps end when no target is missed by more than this [m, rad]."""
MET = 1e-6
"""A target is met if it is missed by no more than this [m, rad]."""
RIDGE = 1e-13
"""Damping of the steps, as a share of the squared motion of the tool."""


class Reached(NamedTuple):
    """Arms at the targets.

    Args:
        q: Joint positions [rad or m].
        met: Whether each target is met within the arm's limits.
        planned: Arms that meet every target next to the nominal arm's posture.
    """

    q: Float[np.ndarray, "arms targets n"]
    met: Bool[np.ndarray, "arms targets"]
    planned: Bool[np.ndarray, " arms"]


def reach_targets(
    actual: Robot,
    made: Float[np.ndarray, "arms k"],
    targets: Float[np.ndarray, "arms targets 4 4"],
    *,
    branches: Float[np.ndarray, "targets branches n"],
    constrained: Bool[np.ndarray, "targets 6"],
) -> Reached:
    """Joint positions of many arms at the targets of a plate.

    Args:
        actual: The arms without their manufacturing errors, K elements in the chain.
        made: Manufacturing errors of every element.
        targets: Actual poses of the tool, measuring frame.
        branches: Nominal joint positions, the planned ones first [rad or m].
        constrained: What of [p; φ] each target constrains.
    """
    arms, count = targets.shape[:2]
    goals, rows = targets.reshape(-1, 4, 4), np.tile(constrained, (arms, 1))
    shift = np.repeat(made, count, axis=0)
    q = np.tile(branches[:, 0], (arms, 1))
    open_ = np.arange(len(q))
    used = np.full(len(q), -1)
    low, high = actual.limits.T
    for number in range(branches.shape[1]):
        starts = branches[open_ % count, number]
        found, met = _step(actual, goals[open_], rows[open_], starts, shift[open_])
        found = _turned_back(actual, found)
        met &= ((found >= low) & (found <= high)).all(1)
        q[open_[met]], used[open_[met]] = found[met], number
        open_ = open_[~met]
        if not len(open_):
            break
    taken = used.reshape(arms, count)
    return Reached(q.reshape(arms, count, -1), taken >= 0, np.logical_and.reduce(taken == 0, axis=1))


def deflected(actual: Robot, q: Float[np.ndarray, "rows n"], made: Float[np.ndarray, "rows k"]) -> np.ndarray:
    """Manufacturing errors of every element, and what undeclared effects add at joint positions."""
    return made + shift_of(actual, Motion(q)) if actual.effects else made


def _step(actual, goals, constrained, q, shift) -> tuple[np.ndarray, np.ndarray]:
    """Newton's iteration from joint positions to the targets, and which of them it met."""
    joints, closed = joint_elements(actual), np.eye(6) * ~constrained[:, :, None]
    for number in range(MAX_NEWTON_STEPS):
        if number < BENDINGS:
            whole = deflected(actual, q, shift)
        at, twists = chains.twists(actual.chain, q, joints, shift=whole)
        off = np.where(constrained, se3.pose_error(goals, at), 0.0)
        if np.abs(off).max() < ARRIVED:
            break
        jacobian = np.where(constrained[:, :, None], twists, 0.0)
        across = np.swapaxes(jacobian, 1, 2)
        gram = jacobian @ across
        damping = RIDGE * np.trace(gram, axis1=1, axis2=2)
        gram += damping[:, None, None] * np.eye(6) + closed
        step = (across @ np.linalg.solve(gram, off[..., None]))[..., 0]
        q = q + step * np.minimum(1.0, STRIDE / np.maximum(np.abs(step).max(1), STRIDE))[:, None]
    return q, np.abs(off).max(1) < MET


def _turned_back(actual: Robot, q: np.ndarray) -> np.ndarray:
    """Revolute joints beyond a limit turned back by a full turn."""
    low, high = actual.limits.T
    turns = np.array([0.0 if j.kind is JointKind.PRISMATIC else TURN for j in actual.moving])
    return q + turns * ((q < low).astype(float) - (q > high))


def branches_by_distance(
    robot: Robot, poses: Float[np.ndarray, "targets 4 4"], q: Float[np.ndarray, "targets n"]
) -> Float[np.ndarray, "targets branches n"]:
    """The planned joint positions at every target, then those of its other branches, the nearest first.

    Args:
        poses: Of the tool, measuring frame.
        q: The planned joint positions [rad or m].
    """
    lists = []
    for planned, result in zip(q, inverse.solve_many(robot, poses), strict=True):
        turned = [branch.nearest_turn(planned) for branch in result.within_limits]
        lists.append([planned, *sorted(turned, key=lambda t: float(np.abs(t - planned).max()))[1:]])
    longest = max(map(len, lists))
    return np.stack([np.stack([listed[k % len(listed)] for k in range(longest)]) for listed in lists])
