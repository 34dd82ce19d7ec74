"""Arms whose masses nobody knows: how their joints may sag, and which torques would hold them.

Both are linear in the same few products, see `arm/effects/gravity_sag.py`.
"""

import numpy as np

from workbench.arm.effects.effect import turns
from workbench.arm.effects.gravity_sag import GravitySag, terms_of
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import NO_WRENCHES
from workbench.base.types import JointRows


def sags(robot: Robot, motion: Motion) -> list[GravitySag]:
    """A sag of every turning joint, by its links and by a payload that varies; none where nothing weighs."""
    if not np.any(robot.gravity):
        return []
    down = tuple((robot.gravity / np.linalg.norm(robot.gravity)).tolist())
    load = motion.payload
    varies = load is not None and bool(np.isfinite(load).all() and np.ptp(load) > 0.0)
    chain = robot.chain
    return [
        GravitySag((j,), terms=terms_of(chain, j, payload=varies), gravity=down)
        for j in range(robot.dof)
        if turns(chain, j)
    ]


def expected_torques(robot: Robot, measured: Motion, other: Motion) -> JointRows:
    """Joint torques [N m] to expect in other rows: the weights that explain the measured ones best.

    Args:
        robot: The arm; the torques of sliding joints are their mean.
        measured: Rows with all torques.
        other: Rows without.
    """
    assert measured.torque is not None, "there is something to learn from"
    out = np.tile(measured.torque.mean(0), (len(other), 1))
    for sag in sags(robot, measured):
        known, asked = (sag.law(robot.chain, m, NO_WRENCHES)[:, 0] for m in (measured, other))
        joint = sag.joints[0]
        out[:, joint] = asked @ np.linalg.lstsq(known, measured.torque[:, joint])[0]
    return out
