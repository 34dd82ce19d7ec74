"""Poses for circle-point analysis: from one posture every joint is turned alone, so that a point of the tool
describes a circle about each axis (Katana §2.2.4; Santolaria & Ginés 2013).
"""

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.base.errors import OptionError

MIN_CIRCLE_POINTS = 5
"""Minimum number of points per circle."""
ARC = float(np.deg2rad(240.0))
"""Longest arc [rad], centred in the joint's range."""
POSTURES = 400
"""Number of random postures, of which the one with the longest lever arms is used."""
MIN_LEVER = 1e-3
"""Minimum lever arm [m]: a point on an axis describes no circle, whatever the posture."""


def circle_poses(robot: Robot, number: int, *, rng: np.random.Generator) -> Float[np.ndarray, "number n"]:
    """Joint positions that turn one joint after the other, equally many of each (the first ones one more).

    Args:
        number: Number of poses; at least five per joint.
    """
    if sliding := [i for i, j in enumerate(robot.moving, start=1) if j.kind is not JointKind.REVOLUTE]:
        raise OptionError(f"joint {sliding[0]} of robot '{robot.name}' is prismatic and describes no circle")
    if number < MIN_CIRCLE_POINTS * robot.dof:
        raise OptionError(
            f"circle points need {MIN_CIRCLE_POINTS} poses per joint, "
            f"{MIN_CIRCLE_POINTS * robot.dof} for robot '{robot.name}', not {number}"
        )
    low, high = robot.search_limits.T
    posture = _posture(robot, rng)
    rows = []
    for joint in range(robot.dof):
        count = number // robot.dof + (joint < number % robot.dof)
        middle, half = 0.5 * (low[joint] + high[joint]), 0.5 * min(high[joint] - low[joint], ARC)
        turned = np.tile(posture, (count, 1))
        turned[:, joint] = np.clip(np.linspace(middle - half, middle + half, count), low[joint], high[joint])
        rows.append(turned)
    return np.concatenate(rows)


def levers(robot: Robot, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows n"]:
    """Distance of the tool point from every joint's axis [m]: the length of its offset's velocity."""
    offsets = robot.joint_offsets
    _, twists = identification_jacobian(robot, Motion(q), offsets)
    return np.linalg.norm(twists[:, :3], axis=1)


def _posture(robot: Robot, rng: np.random.Generator) -> Float[np.ndarray, " n"]:
    """The posture whose levers have the largest product."""
    low, high = robot.search_limits.T
    q = rng.uniform(low, high, (POSTURES, robot.dof))
    return q[np.argmax(np.log(levers(robot, q) + MIN_LEVER).sum(axis=1))]
