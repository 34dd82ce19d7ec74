"""Bearing compliance: the later link tips over in proportion to the moment across the joint's axis.

    (Δv_x, Δv_y) = −c (τ_x, τ_y)

about the two axes across the joint's own, right before it; c [rad/(N m)].
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects.effect import (
    AbstractEffect,
    Insertion,
    Loads,
    across,
    across_components,
    inserted_names,
    paired,
)


@final
@dataclass(frozen=True)
class BearingCompliance(AbstractEffect):
    """One coefficient a joint."""

    name = "bearing-compliance"
    loads = Loads.ALL
    insertion = Insertion.TILT

    @property
    def names(self):
        return tuple(f"joint{j + 1}.bearing_compliance" for j in self.joints)

    def units(self, chain):
        return ("rad/(N*m)",) * len(self.joints)

    def elements(self, chain):
        return inserted_names(chain, self.joints, self.insertion)

    def law(self, chain, motion, wrenches):
        return paired(-across(chain, self.joints, wrenches))

    def components(self, chain):
        return across_components(chain, self.joints)

    def slope(self, chain, motion, wrenches):
        return np.tile(-np.diag(np.repeat(self.coefficients, 2)), (len(motion), 1, 1))
