"""Deflection of the arm in its current pose: what its effects add at each joint, from the pose alone."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.axes import Insertion, across_axes, driven
from workbench.arm.kinematics.skeleton import body_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import deflect
from workbench.arm.statics.wrenches import own_axis
from workbench.base.errors import WorkbenchError
from workbench.base.types import Outcome
from workbench.session.state import Session

MAX_DRAWN = 0.1
"""Maximum displacement at which a deflected arm is drawn, as a multiple of its reach."""
HALVINGS = 40


@dataclass(frozen=True, eq=False, kw_only=True)
class Bending:
    """The deflection of an arm in one pose.

    Args:
        shift: What the effects add to each element of the chain, one row [rad or m]; 0 without equilibrium.
        about: What they add along each joint's own coordinate [rad or m].
        across: Tilt of each joint's link about the two axes across the joint's own [rad].
        moment: Moment about and across each joint's axis that holds the later link [N m]; None without loads.
        outcome: Whether the arm can hold itself there.
    """

    shift: Float[np.ndarray, "1 k"]
    about: Float[np.ndarray, " n"]
    across: Float[np.ndarray, " n"]
    moment: Float[np.ndarray, "n 2"] | None
    outcome: Outcome


def bending_robot(session: Session) -> Robot | None:
    """The arm whose deflection is drawn: the shown fit, or else the opened one; None without effects."""
    for robot in (session.results.calibrated, session.robot):
        if robot is not None and robot.effects:
            return driven_by_pose(robot)
    return None


def bend(robot: Robot, q: Float[np.ndarray, " n"]) -> Bending:
    """The arm at rest at these joint positions, under its own weight."""
    deflected = deflect(robot, Motion(q[None]))
    chain, shift = robot.chain, np.nan_to_num(deflected.shift)
    elements = [chain.index[driven(chain, j).name] for j in range(robot.dof)]
    return Bending(
        shift=shift,
        about=shift[0, elements],
        across=np.array([_tipped(robot, shift[0], j) for j in range(robot.dof)]),
        moment=_moments(robot, deflected.wrenches[0]) if len(deflected.wrenches) else None,
        outcome=deflected.outcome,
    )


def drawable_bending(robot: Robot, q: Float[np.ndarray, " n"], times: float) -> float:
    """The exaggeration, or as much of it as bends no part of the arm by more than a tenth of its reach.

    The displacement grows nearly in proportion to the factor; where it doesn't, halving goes on from there.
    """
    straight, shift = body_frames(robot, q[None])[0, :, :3, 3], bend(robot, q).shift
    maximum = MAX_DRAWN * robot.reach
    for _ in range(HALVINGS):
        moved = body_frames(robot, q[None], shift=times * shift)[0, :, :3, 3] - straight
        off = float(np.linalg.norm(moved, axis=1).max())
        if off <= maximum:
            return times
        times *= max(0.99 * maximum / off, 0.5)
    return times


@lru_cache(maxsize=8)
def driven_by_pose(robot: Robot) -> Robot | None:
    """The robot with those of its effects that need nothing but the pose; None without any."""
    still = Motion(np.clip(np.zeros((1, robot.dof)), *robot.search_limits.T))
    kept = []
    for effect in robot.effects:
        try:
            deflect(robot.with_effects(effect), still)
        except WorkbenchError:  # it needs a temperature, a time or the last motion
            continue
        kept.append(effect)
    return robot.with_effects(*kept) if kept else None


def _tipped(robot: Robot, shift: np.ndarray, joint: int) -> float:
    """Angle of a joint's link about the axes across its own [rad]."""
    index, total = robot.chain.index, np.zeros(2)
    for kind in (Insertion.TILT, Insertion.BEND):
        for place, axis in enumerate(across_axes(robot.chain, joint)):
            element = index.get(kind.element(joint, axis))
            total[place] += 0.0 if element is None else shift[element]
    return float(np.linalg.norm(total))


def _moments(robot: Robot, wrenches: Float[np.ndarray, "n 6"]) -> Float[np.ndarray, "n 2"]:
    """Moment about and across each joint's axis [N m]."""
    moments, axes = wrenches[:, 3:], own_axis(robot) % 3
    about = np.take_along_axis(moments, axes[:, None], axis=1)[:, 0]
    across = np.sqrt(np.maximum((moments**2).sum(1) - about**2, 0.0))
    return np.stack([about, across], axis=1)
