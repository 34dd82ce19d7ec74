"""The surprise of a virtual arm: an effect that geometry can't explain, of a size that shows."""

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.backlash import Backlash
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.arm.robot import JointKind, Robot

HARMONIC, BACKLASH, COMPLIANCE = 3e-3, 1.5e-3, 5e-4
"""Typical sizes [rad], [rad], [rad/(N m)]."""


def hidden_effect(robot: Robot, rng: np.random.Generator) -> AbstractEffect:
    """One effect at one joint; those that need loads only where the robot has masses."""
    turning = [i for i, j in enumerate(robot.moving) if j.kind is JointKind.REVOLUTE]
    joint = int(rng.choice(turning or range(robot.dof)))
    size = rng.uniform(0.7, 1.5)
    choices: list[AbstractEffect] = []
    if turning:
        phase = rng.uniform(0.0, 2.0 * np.pi)
        pair = (HARMONIC * size * np.cos(phase), HARMONIC * size * np.sin(phase))
        choices.append(JointHarmonic((joint,), pair, order=int(rng.integers(1, 4))))
    if robot.has_masses or not choices:
        loaded = turning[1] if len(turning) > 1 else joint
        choices += [Backlash((loaded,), (BACKLASH * size,)), JointCompliance((loaded,), (COMPLIANCE * size,))]
    return choices[int(rng.integers(len(choices)))]
