"""
An effect of your own
=====================

A law and a sentence are all that an effect needs. Once it is registered, the simulator hides it, the
diagnosis finds it, files keep it, and a compensated path takes it into account.
"""

from dataclasses import dataclass

import numpy as np

import workbench as wb
from workbench.arm.effects import AbstractEffect, Loads
from workbench.arm.effects.axes import diagonal, own


@dataclass(frozen=True)
class GearSag(AbstractEffect):
    """Teeth that flatten: the angle gives way with the root of the moment."""

    name = "gear-sag"
    loads = Loads.OWN

    def law(self, chain, motion, wrenches):
        moment = own(chain, self.joints, wrenches)  # about the joint's axis [N m]
        return diagonal(-np.sign(moment) * np.sqrt(np.abs(moment)))

    def sentence(self, chain, motion):
        return f"{self.where} gives way by {self.size(chain)} at 1 N m, and by twice that at 4 N m"


forget = wb.register(wb.Parts(effects=[GearSag]))

# %%
# Hidden in joint 2 of a virtual arm, and found again:

arm = wb.load_robot("aria")
_, data = wb.measure_poses(arm, 80, effects=["gear-sag:2:4e-4"], seed=1)
found = wb.diagnose(arm, data)
found

# %%
# What was registered is known to everything from here on; this program forgets it at its end.

names = {effect.name for effect in found.robot.effects}
forget()
assert "gear-sag" in names
