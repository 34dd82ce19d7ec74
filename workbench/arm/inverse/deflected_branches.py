"""The branches of a deflecting arm: those of its geometry, corrected so that it meets the target."""

from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float

from workbench.arm.inverse import unreachable
from workbench.arm.inverse.branch import LIMIT_SLACK, Branch, InverseResult, Nearest, margins, quality
from workbench.arm.inverse.damped_newton import Refined, unlimited
from workbench.arm.inverse.deflected_arm import refine_deflected
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.base.types import frozen

PROBE = 1e-6
"""How far the joints are moved to see which one jumps [rad or m]."""


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
        rigid: What the geometry alone can do.
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
    notes = [rigid.note] if rigid.note else []
    notes += [
        _jumping(robot, b.name, row, float(left), state)
        for b, row, left, ok in zip(rigid.branches, moved, found.position_error, found.converged, strict=True)
        if not ok
    ]
    explain = partial(_explain, robot, rigid, tuple(branches), found, limits)
    return replace(rigid, branches=tuple(branches), note="; ".join(notes) or None, explain=explain)


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
    """The best branch, with what the deflected arm leaves there."""
    row = [b.name for b in branches].index(best.name)
    return Nearest(best.q, float(found.position_error[row]), float(found.rotation_error[row]))


def _jumping(robot: Robot, name: str, q: np.ndarray, left: float, motion: Motion | None) -> str:
    """The joint whose deflection jumps so that no joint position holds the target."""
    probes = q + PROBE * np.concatenate([np.eye(len(q)), -np.eye(len(q))])
    rows = np.zeros(len(probes), np.int64)
    state = Motion(probes) if motion is None else motion.take(rows).at(probes)
    jump = np.ptp(shift_of(robot, state), axis=0)
    owner = robot.chain.elements[int(np.argmax(jump))].name.partition(".")[0]
    return (
        f"'{name}' is held only to {1e3 * left:.3g} mm: the deflection of {owner} jumps there (its load "
        "changes direction within its play) that no joint position reaches the target"
    )
