"""Joint compliance: the angle about a joint's axis gives way in proportion to the moment about it.

Δv = −c τ,      τ the holding moment about (force along) the axis, c [rad/(N m) or m/N]
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects.effect import (
    AbstractEffect,
    Insertion,
    Loads,
    diagonal,
    driven_names,
    own,
    own_components,
    turns,
)


@final
@dataclass(frozen=True)
class JointCompliance(AbstractEffect):
    """One coefficient a joint."""

    name = "joint-compliance"
    loads = Loads.OWN
    insertion = Insertion.NONE

    @property
    def names(self):
        return tuple(f"joint{j + 1}.compliance" for j in self.joints)

    def units(self, chain):
        return tuple("rad/(N*m)" if turns(chain, j) else "m/N" for j in self.joints)

    def elements(self, chain):
        return driven_names(chain, self.joints)

    def law(self, chain, motion, wrenches):
        return diagonal(-own(chain, self.joints, wrenches))

    def components(self, chain):
        return own_components(chain, self.joints)

    def slope(self, chain, motion, wrenches):
        return np.tile(-np.diag(self.coefficients), (len(motion), 1, 1))
