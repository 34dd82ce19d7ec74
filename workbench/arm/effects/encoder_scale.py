"""Encoder scale: a joint moves slightly further than the controller reports.

Δv = c q,      c without unit
"""

from dataclasses import dataclass
from typing import final

from workbench.arm.effects.axes import diagonal, turns
from workbench.arm.effects.effect import AbstractEffect


@final
@dataclass(frozen=True)
class EncoderScale(AbstractEffect):
    """One coefficient a joint."""

    name = "encoder-scale"
    coefficient = "scale"

    def units(self, chain):
        return ("1",) * len(self.joints)

    def law(self, chain, motion, wrenches):
        return diagonal(motion.q[:, list(self.joints)])

    def sentence(self, chain, motion):
        moves = "turns" if turns(chain, self.joints[0]) else "slides"
        return (
            f"{self.where} {moves} {self.size(chain)} too {'far' if self.coefficients[0] > 0 else 'little'}"
        )
