"""Encoder scale: a joint moves slightly further than the controller reports.

Δv = c q,      c without unit
"""

from dataclasses import dataclass
from typing import final

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, diagonal
from workbench.arm.effects.effect import AbstractEffect, Law
from workbench.arm.motion import Motion


@final
@dataclass(frozen=True)
class EncoderScale(AbstractEffect):
    """One coefficient per joint."""

    name = "encoder-scale"
    does = "{} moves farther than it counts", "{} move farther than they count"
    coefficient = "scale"
    unit = ("1", "1")
    largest = 0.03
    """Teeth and counts are whole numbers, so gears are exact. The pulleys of a cable drive are made to 1 %,
    and a controller may be set to a sister model's ratio (WAM wrists: 9.7 for 9.48)."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return diagonal(motion.q[:, list(self.joints)])
