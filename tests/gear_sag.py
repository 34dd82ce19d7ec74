"""An effect of another package, for whatever takes one."""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects import AbstractEffect, Loads
from workbench.arm.effects.axes import diagonal, own


@final
@dataclass(frozen=True)
class GearSag(AbstractEffect):
    """Teeth that flatten: Δv = −c sign(τ) √|τ|. The least that an effect can be."""

    name = "gear-sag"
    loads = Loads.OWN

    def law(self, chain, motion, wrenches):
        moment = own(chain, self.joints, wrenches)
        return diagonal(-np.sign(moment) * np.sqrt(np.abs(moment)))

    def slope(self, chain, motion, wrenches):
        moment = np.maximum(np.abs(own(chain, self.joints, wrenches)), 1e-3)
        return diagonal(-np.array(self.coefficients) / (2.0 * np.sqrt(moment)))

    def sentence(self, chain, motion):
        return f"{self.where} winds up by {self.size(chain)} at 1 N·m, and twice as much at 4 N·m"
