"""Reach margin: postures that arms with manufacturing errors can also reach.

Errors δ of an arm's constants put its tool beside the nominal pose by S δ, S the tool's twist per constant.
Such an arm meets a target where the nominal one would meet it moved by −S δ. Of all arms within three
deviations Σ of their constants, the one that has to move its joints the farthest,

    e = 3 S Σ v,      v the first right singular vector of J⁺ S Σ,

goes past the limits or the end of the arm's reach first (the most probable point of failure; Hasofer & Lind,
J. Eng. Mech. Div. 100(1), 1974). A posture has margin if the nominal arm follows the target to both ± e.
"""

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.inverse.follow import follow_many
from workbench.arm.kinematics.forward import geometric_jacobian, identification_jacobian
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.data.simulation.simulate import LIKELY_ERRORS

DEVIATIONS = 3.0
"""Manufacturing errors up to this many standard deviations must still allow a planned target."""


def with_reach_margin(
    robot: Robot, q: Float[np.ndarray, "rows n"], *, errors: tuple[float, float] = LIKELY_ERRORS
) -> Bool[np.ndarray, " rows"]:
    """Which postures arms with manufacturing errors can also reach.

    Args:
        q: Within the limits [rad or m].
        errors: Maximum errors, evenly spread, of an arm's lengths [m] and angles [rad].
    """
    names, elements = robot.default_free, robot.chain.elements
    turns = np.array([elements[i].axis.turns for i in robot.chain.indices(names)], bool)
    poses, twists = identification_jacobian(robot, Motion(q), names)
    off = twists * np.where(turns, errors[1], errors[0]) / np.sqrt(3.0)
    steps = np.linalg.pinv(geometric_jacobian(robot, q)) @ off
    farthest = np.linalg.svd(steps, full_matrices=False)[2][:, 0]
    error = DEVIATIONS * (off @ farthest[..., None])[..., 0]
    reached = np.ones(len(q), bool)
    for side in (1.0, -1.0):
        turned = se3.rotvec_to_matrix(side * error[:, 3:]) @ poses[:, :3, :3]
        beside = se3.pose(turned, poses[:, :3, 3] + side * error[:, :3])
        reached &= follow_many(robot, beside, q).converged
    return reached
