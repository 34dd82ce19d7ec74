"""Backlash: a joint lies on one flank of its play or on the other.

    Δv = −c sign(τ),        by = "moment": the load decides; τ the holding moment about the axis
    Δv = −c direction,      by = "motion": the link lags behind the drive

c is half the play [rad or m]. A row in which the flanks hand over within the play itself has no steady
answer; it keeps the side of the last round.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects.axes import diagonal, own
from workbench.arm.effects.effect import AbstractEffect, offered
from workbench.arm.effects.law import Loads

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
    coefficient = "backlash"
    has_play = True

    @property
    def loads(self):
        return Loads.NONE if self.by == "motion" else Loads.OWN

    @property
    def needs(self):
        return ("direction",) if self.by == "motion" else ()

    @property
    def names(self):
        word = "backlash_by_motion" if self.by == "motion" else "backlash"
        return tuple(f"joint{j + 1}.{word}" for j in self.joints)

    @property
    def variant(self):
        return "by motion" if self.by == "motion" else ""

    def law(self, chain, motion, wrenches):
        if self.by == "motion":
            return diagonal(-np.sign(motion.need("direction", self.name)[:, list(self.joints)]))
        return diagonal(-np.sign(own(chain, self.joints, wrenches)))

    def mistake(self, chain):
        return None if self.by in CAUSES else f"has by = '{self.by}'; known are {' and '.join(CAUSES)}"

    def sentence(self, chain, motion):
        cause = "last motion" if self.by == "motion" else "load"
        return f"{self.where} has play of {self.size(chain)} to either side; its {cause} decides which"

    @classmethod
    def offers(cls, arm, motion):
        yield from offered([cls((j,)) for j in range(arm.dof)], arm, motion)
        both_ways = [j for j in range(arm.dof) if motion.direction is None or np.ptp(motion.direction[:, j])]
        yield from offered([cls((j,), by="motion") for j in both_ways or range(arm.dof)], arm, motion)

    @classmethod
    def example(cls, arm, joint, rng):
        return cls((joint,), (1.0,), by="moment" if arm.has_masses else "motion")
