"""How well the constants of an arm under a load test are known, and postures in which that decides too much.

Backlash lies on the side that the sign of a moment tells, clearance tips the way a moment across the axis
points. Where such a moment is no larger than what the constants' errors make of it, the model may take the
other side than the arm does, and errs by the whole play. No standard error tells of that.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool

from workbench.arm.effects.axes import across_components, own_components
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.arm.statics.moments import joint_moments
from workbench.arm.statics.wrenches import TrialArm, masses, motion_wrenches
from workbench.base.types import JointRows

LENGTH = 5e-5
"""Maximum error of a length [m]."""
ANGLE = float(np.deg2rad(0.1))
"""Maximum error of an angle [rad]."""
CENTRE = 2e-3
"""Standard deviation of a link's centre of mass along each axis, as drawings or a balance give it [m]."""
CLEAR_SIDE_SIGMAS = 4.0
"""Standard deviations of a moment that leave no doubt about its side."""


def constants_known(robot: Robot) -> dict[str, float]:
    """Standard deviations of constants, even up to a maximum error, and of masses and their centres [SI]."""
    elements, index = robot.chain.elements, robot.chain.index
    maximum = {n: ANGLE if elements[index[n]].axis.turns else LENGTH for n in robot.default_free}
    return {n: size / np.sqrt(3.0) for n, size in maximum.items()} | robot.inertia_tolerance


def has_certain_load_sides(
    robot: Robot, motion: Motion, known: Mapping[str, float]
) -> tuple[Bool[np.ndarray, "rows n"], Bool[np.ndarray, "rows n"]]:
    """Whether the moments about every axis, and those across it, surely point where the model has them.

    Args:
        known: Standard deviation of each of the arm's constants and masses.
    """
    moments, (about, across) = joint_moments(robot, motion), moment_errors(robot, motion, known)
    return np.abs(moments.about) >= CLEAR_SIDE_SIGMAS * about, moments.tipping >= CLEAR_SIDE_SIGMAS * across


def moment_errors(robot: Robot, motion: Motion, known: Mapping[str, float]) -> tuple[JointRows, JointRows]:
    """Standard deviations of the moments about every axis and across it, to first order [N m]."""
    chain, joints = robot.chain, range(robot.dof)
    own = np.array([*robot.inertia.values()], float)
    place = {inertial: i for i, inertial in enumerate(robot.inertia)}
    axes = np.concatenate([own_components(chain, joints), across_components(chain, joints)]).T

    def moments(name: str = "", change: float = 0.0) -> np.ndarray:
        values, loads = chain.values.copy(), own.copy()
        if name in place:
            loads[place[name]] += change
        elif name:
            values[chain.index[name]] += change
        weights = masses(robot).with_values(loads)
        arm = TrialArm(robot, robot.chain.with_values(values), robot.effects, weights)
        return motion_wrenches(arm, motion, shift=shift_of(arm, motion))[:, *axes]

    at = moments()
    squares = sum((moments(name, std) - at) ** 2 for name, std in known.items()) + np.zeros(at.shape)
    about, across = np.split(squares, [robot.dof], axis=1)
    return np.sqrt(about), np.sqrt(across.reshape(len(at), -1, 2).sum(axis=-1))
