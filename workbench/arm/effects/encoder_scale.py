"""Encoder scale: a joint moves a little further than the controller counts.

Δv = c q,      c without unit
"""

from dataclasses import dataclass
from typing import final

from workbench.arm.effects.effect import (
    AbstractEffect,
    Insertion,
    Loads,
    diagonal,
    driven_names,
)


@final
@dataclass(frozen=True)
class EncoderScale(AbstractEffect):
    """One coefficient a joint."""

    name = "encoder-scale"
    loads = Loads.NONE
    insertion = Insertion.NONE

    @property
    def names(self):
        return tuple(f"joint{j + 1}.scale" for j in self.joints)

    def units(self, chain):
        return ("1",) * len(self.joints)

    def elements(self, chain):
        return driven_names(chain, self.joints)

    def law(self, chain, motion, wrenches):
        return diagonal(motion.q[:, list(self.joints)])
