"""Backlash: a joint lies on one flank of its play or on the other.

    Δv = −c sign(τ),        by = "moment": the load decides; τ the holding moment about the axis
    Δv = −c direction,      by = "motion": the link lags behind the drive

c is half the play [rad or m]. A row in which the flanks hand over within the play itself has no steady
answer; it keeps the side of the last round.
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
    turns,
)

CAUSES = ("moment", "motion")


@final
@dataclass(frozen=True)
class Backlash(AbstractEffect):
    """One coefficient a joint.

    Args:
        by: `moment` or `motion`: what decides on which flank a joint lies.
    """

    by: str = "moment"
    name = "backlash"
    insertion = Insertion.NONE

    @property
    def loads(self):
        """The moment about the axis, unless motion decides."""
        return Loads.NONE if self.by == "motion" else Loads.OWN

    @property
    def names(self):
        """`joint3.backlash`, or `joint3.backlash_by_motion`."""
        word = "backlash_by_motion" if self.by == "motion" else "backlash"
        return tuple(f"joint{j + 1}.{word}" for j in self.joints)

    def units(self, chain):
        """Those of the joints."""
        return tuple("rad" if turns(chain, j) else "m" for j in self.joints)

    def elements(self, chain):
        """What the joints drive."""
        return driven_names(chain, self.joints)

    def law(self, chain, motion, wrenches):
        """See the module."""
        if self.by == "motion":
            return diagonal(-np.sign(motion.need("direction", self.name)[:, list(self.joints)]))
        return diagonal(-np.sign(own(chain, self.joints, wrenches)))

    def mistake(self, chain):
        """An unknown cause."""
        return None if self.by in CAUSES else f"has by = '{self.by}'; known are {' and '.join(CAUSES)}"
