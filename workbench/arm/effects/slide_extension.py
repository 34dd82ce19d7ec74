"""A prismatic joint whose compliance and clearance grow with its extension: a lift, a telescope, a linear
axis.

    (Δv_1, Δv_2) = −c s (τ_1, τ_2)                       compliance, c [rad/(N m m)]
    (Δv_1, Δv_2) = −c s (τ_1, τ_2) / |(τ_1, τ_2)|        play, c half of its angle per length [rad/m]

about the two axes across the joint, right after its driven element; s = q − q_0 is its extension, q_0 its
retracted position, and τ the holding moment. A column of length s bends by s M/(E I) under a moment M, and
guides with less overlap have more clearance. Parts independent of extension are `link-flexure`,
`bearing-compliance` and `clearance-tilt`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, across, blocks, paired, turns
from workbench.arm.effects.clearance_tilt import direction_of
from workbench.arm.effects.effect import AbstractEffect, Candidate, EffectArm, moved_joints, offered
from workbench.arm.effects.law import Law, Loads, Slope, Wrenches
from workbench.arm.motion import Motion


def extension(joints: tuple[int, ...], retracted: float, motion: Motion) -> np.ndarray:
    """Extension of joints, (rows, joints) [m]."""
    return motion.q[:, list(joints)] - retracted


def sliding_joints(arm: EffectArm, motion: Motion) -> list[tuple[int, float]]:
    """Prismatic joints that moved, with their retracted positions [m]."""
    low = arm.search_limits[:, 0]
    return [(j, float(low[j])) for j in moved_joints(motion) if not turns(arm.chain, j)]


@dataclass(frozen=True)
class AbstractExtension(AbstractEffect):
    """One coefficient per joint that slides.

    Args:
        retracted: Position q_0 without deflection or clearance [m].
    """

    retracted: float = 0.0
    loads = Loads.ALL
    insertion = Insertion.BEND
    credible = (0.02, 0.0)
    """At the largest moment and extension of the rows, as for a bearing."""

    @classmethod
    def offers(cls, arm: EffectArm, motion: Motion) -> Iterator[Candidate | str]:
        return offered([cls((j,), retracted=low) for j, low in sliding_joints(arm, motion)], arm, motion)


@final
@dataclass(frozen=True)
class ExtensionCompliance(AbstractExtension):
    """Bends in proportion to load and extension."""

    name = "extension-compliance"
    does = "{} tips under load as it extends", "{} tip under load as they extend"
    unit = ("rad/(N*m*m)", "")

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        reach = extension(self.joints, self.retracted, motion)[..., None]
        return paired(-reach * across(chain, self.joints, wrenches))

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        soft = np.repeat(extension(self.joints, self.retracted, motion) * self.coefficients, 2, axis=1)
        return -soft[:, :, None] * np.eye(soft.shape[1])

    def sentence(self, chain: Chain, motion: Motion) -> str:
        size = f"{1e3 * max(map(abs, self.coefficients)):.3g} mrad/(N·m)"
        return f"{self.where} tilts by {size} per metre of extension under its load"


@final
@dataclass(frozen=True)
class ExtensionClearance(AbstractExtension):
    """Tips over to the side of its load, in proportion to extension."""

    name = "extension-clearance"
    does = "{} has play that grows as it extends", "{} have play that grows as they extend"
    unit = ("rad/m", "")
    has_play = True

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        reach = extension(self.joints, self.retracted, motion)[..., None]
        return paired(-reach * direction_of(across(chain, self.joints, wrenches))[0])

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        direction, size = direction_of(across(chain, self.joints, wrenches))
        turning = np.eye(2) - direction[..., :, None] * direction[..., None, :]
        loose = extension(self.joints, self.retracted, motion) * self.coefficients
        return blocks(-turning * (loose[..., None] / size)[..., None])

    def sentence(self, chain: Chain, motion: Motion) -> str:
        size = f"{1e3 * max(map(abs, self.coefficients)):.3g} mrad"
        return f"{self.where} has clearance of ±{size} per metre of extension"
