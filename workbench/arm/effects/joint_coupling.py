"""Joint coupling: one joint moves along with another, as the motors of a wrist do.

Δv_i = c q_j,      joints = (i, j), c [unit of joint i per unit of joint j]
"""

from dataclasses import dataclass
from typing import final

from workbench.arm.effects.effect import (
    AbstractEffect,
    Insertion,
    Loads,
    driven_names,
    turns,
)


@final
@dataclass(frozen=True)
class JointCoupling(AbstractEffect):
    """One coefficient: of the first joint, by the second."""

    name = "joint-coupling"
    loads = Loads.NONE
    insertion = Insertion.NONE

    @property
    def names(self):
        return tuple(f"joint{self.joints[0] + 1}.by_joint{j + 1}" for j in self.joints[1:2])

    def units(self, chain):
        pair = ["rad" if turns(chain, j) else "m" for j in self.joints]
        return ("1" if pair[0] == pair[1] else "/".join(pair),)

    def elements(self, chain):
        return driven_names(chain, self.joints[:1])

    def law(self, chain, motion, wrenches):
        return motion.q[:, self.joints[1], None, None].copy()

    def mistake(self, chain):
        if len(self.joints) != 2:
            return f"has {len(self.joints)} joints but needs two: which one moves, and by which one"
        return None
