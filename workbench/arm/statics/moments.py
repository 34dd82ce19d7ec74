"""Joint moments, at rest and in motion, split into drive torques and tilting moments on the bearing.

    η_i = (moment about the axis, moments about the two axes across it)

of the wrenches through the deflected arm's joints (`wrenches`, recursive Newton–Euler), in the axes of the
frame right before each drive, which stand on the earlier link. They hold the later link: minus the
loads of Katana eqs. (4.21) and (5.14). Links are point masses, so that N_i of (5.14) is nil.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.axes import across, own
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.arm.statics.wrenches import motion_wrenches
from workbench.base.types import JointRows


@dataclass(frozen=True, eq=False)
class JointMoments:
    """Holding moments of an arm.

    Args:
        about: Torque of every drive [N m]; force [N] of a prismatic joint.
        across: Moments carried by its bearing, about the two axes across the joint's own in cyclic order
            (x and y of a joint about z) [N m].
    """

    about: JointRows
    across: Float[np.ndarray, "rows n 2"]

    @property
    def tipping(self) -> JointRows:
        """Size of the moment across each axis [N m]."""
        return np.linalg.norm(self.across, axis=-1)


def joint_moments(robot: Robot, motion: Motion) -> JointMoments:
    """Moments at every joint of an arm, deflected by its effects.

    Args:
        motion: Joint positions; velocities, accelerations, payload and wrench at the tool if known.
    """
    wrenches = motion_wrenches(robot, motion, shift=shift_of(robot, motion))
    joints = range(robot.dof)
    return JointMoments(own(robot.chain, joints, wrenches), across(robot.chain, joints, wrenches))
