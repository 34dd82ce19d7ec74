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
        return Loads.NONE if self.by == "motion" else Loads.OWN

    @property
    def names(self):
        word = "backlash_by_motion" if self.by == "motion" else "backlash"
        return tuple(f"joint{j + 1}.{word}" for j in self.joints)

    def units(self, chain):
        return tuple("rad" if turns(chain, j) else "m" for j in self.joints)

    def elements(self, chain):
        return driven_names(chain, self.joints)

    def law(self, chain, motion, wrenches):
        if self.by == "motion":
            return diagonal(-np.sign(motion.need("direction", self.name)[:, list(self.joints)]))
        return diagonal(-np.sign(own(chain, self.joints, wrenches)))

    def mistake(self, chain):
        return None if self.by in CAUSES else f"has by = '{self.by}'; known are {' and '.join(CAUSES)}"
