"""Joint compliance: a joint deflects about its axis in proportion to the moment about it.

Δv = −c τ,      τ the holding moment about (force along) the axis, c [rad/(N m) or m/N]
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, diagonal, own
from workbench.arm.effects.effect import AbstractEffect, Law, Loads, Slope
from workbench.arm.motion import Motion


@final
@dataclass(frozen=True)
class JointCompliance(AbstractEffect):
    """One coefficient per joint."""

    name = "joint-compliance"
    does = "{} gives under load", "{} give under load"
    of_many_joints = True
    coefficient = "compliance"
    loads = Loads.OWN
    unit = ("rad/(N*m)", "m/N")
    credible = (0.05, 0.01)
    """At the largest moment of the rows, taken as the rated one. Catalogues of strain wave gears give a wind-
    up of about 1 mrad at the rated torque, whatever their size; hobby servos deflect by 3°."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return diagonal(-own(chain, self.joints, wrenches))

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        return np.tile(-np.diag(self.coefficients), (len(motion), 1, 1))
