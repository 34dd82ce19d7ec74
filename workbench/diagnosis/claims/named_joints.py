"""Joints of an effect that a cause may name: those with a significant coefficient."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.effect import MIN_STATED_ERRORS as STATED
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.base.wording import joint_list
from workbench.diagnosis.claims.standard_errors import StandardErrors

MIN_NAMED_ERRORS = 4.0
"""Minimum standard errors of a coefficient for its joint to be named in a certain cause."""


def without_joints(effect: AbstractEffect, joints: Sequence[int]) -> AbstractEffect:
    if not joints:
        return effect
    kept = [i for i, j in enumerate(effect.joints) if j not in joints]
    sizes = np.reshape(effect.coefficients, (len(effect.joints), -1))[kept].ravel().tolist()
    return replace(effect, joints=tuple(effect.joints[i] for i in kept), coefficients=tuple(sizes))


def clearness(effects: Sequence[AbstractEffect], std: Mapping[str, float]) -> dict[int | None, float]:
    """Standard errors by which the largest coefficient differs from zero, per joint if joints share such
    effects; under None for other effects."""
    out: dict[int | None, float] = {}
    for effect in effects:
        z = [abs(c) / std[n] for n, c in zip(effect.names, effect.coefficients, strict=True)]
        joints = effect.joints if effect.of_many_joints else (None,)
        for joint, mine in zip(joints, np.array_split(z, len(joints)), strict=True):
            out[joint] = max(out.get(joint, 0.0), float(mine.max()))
    return out


@beside("the description of an effect", "an effect")
def sentence_of(
    effect: AbstractEffect, unsure: Sequence[int], std: StandardErrors, arm: Robot, motion: Motion
) -> str:
    """Description of an effect in its sure joints, and which others may have it too.

    Args:
        effect: With its identified coefficients.
        unsure: Joints that may not be named.
        std: Of its coefficients; insignificant sizes are not stated.
    """
    sizes = clearness([effect], std)
    hidden = [j for j, z in sizes.items() if j is not None and (z < STATED or j in unsure)]
    hidden = [*unsure] if len(hidden) == len(sizes) else hidden
    shown = without_joints(effect, hidden)
    text = shown.stated(arm.chain, motion, std.covariance(shown.names))
    return f"{text}; not clear for {joint_list(hidden)}" if hidden else text
