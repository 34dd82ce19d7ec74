"""Bearing compliance: the distal link tilts in proportion to the moment across the joint's axis.

    (Δv_x, Δv_y) = −c (τ_x, τ_y)

about the two axes across the joint's own, right before it; c [rad/(N m)].
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, across, paired
from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.effects.law import Law, Loads, Slope, Wrenches
from workbench.arm.motion import Motion


@final
@dataclass(frozen=True)
class BearingCompliance(AbstractEffect):
    """One coefficient per joint."""

    name = "bearing-compliance"
    does = "the bearing of {} gives under load", "the bearings of {} give under load"
    of_many_joints = True
    loads = Loads.ALL
    insertion = Insertion.TILT
    unit = ("rad/(N*m)", "")
    credible = (0.02, 0.0)
    """At the largest moment of the rows: 1°, where ball bearings would be overloaded."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return paired(-across(chain, self.joints, wrenches))

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        return np.tile(-np.diag(np.repeat(self.coefficients, 2)), (len(motion), 1, 1))

    def sentence(self, chain: Chain, motion: Motion) -> str:
        if len(self.joints) > 1:
            return f"{self.where} tilt by up to {self.size(chain)} under the moments across their axes"
        return f"{self.where} tilts by {self.size(chain)} under the moment across its axis"
