"""Base drift: the measuring frame creeps with time.

    Δv = c (t − t_ref)

for the base's position, along the axes of the measuring frame, and for three rotations behind its own, about
the axes of the base; c [m/s] and [rad/s]. Gravity stays with the arm: it is the instrument that creeps.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects.effect import AbstractEffect, Insertion, Loads

PARTS = (("x", "m/s"), ("y", "m/s"), ("z", "m/s"), ("roll", "rad/s"), ("pitch", "rad/s"), ("yaw", "rad/s"))


@final
@dataclass(frozen=True)
class BaseDrift(AbstractEffect):
    """Six coefficients.

    Args:
        reference: Time t_ref at which the base stands as given [s].
    """

    reference: float = 0.0
    name = "base-drift"
    loads = Loads.NONE
    insertion = Insertion.DRIFT

    @property
    def names(self):
        return tuple(f"drift.{part}" for part, _ in PARTS)

    def units(self, chain):
        return tuple(unit for _, unit in PARTS)

    def elements(self, chain):
        return tuple(f"base.{part if k < 3 else 'drift_' + part}" for k, (part, _) in enumerate(PARTS))

    def law(self, chain, motion, wrenches):
        return (motion.need("time", self.name) - self.reference)[:, None, None] * np.eye(len(PARTS))

    def mistake(self, chain):
        return "concerns the measuring frame; leave joints out" if self.joints else None
