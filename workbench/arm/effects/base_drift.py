"""Base drift: the measuring frame drifts with time.

    Δv = c (t − t_ref)

for the base's position, along the axes of the measuring frame, and for three rotations behind its own, about
the axes of the base; c [m/s] and [rad/s]. Gravity stays fixed to the arm: it is the instrument that drifts.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.effects.axes import Insertion
from workbench.arm.effects.effect import AbstractEffect, offered
from workbench.arm.effects.plots import DRIVERS, view_of_element

PARTS = ("x", "y", "z", "roll", "pitch", "yaw")
SECONDS = 3600.0
"""Of an hour."""


@final
@dataclass(frozen=True)
class BaseDrift(AbstractEffect):
    """Six coefficients.

    Args:
        reference: Time t_ref at which the base is where it is said to be [s].
    """

    reference: float = 0.0
    name = "base-drift"
    insertion = Insertion.DRIFT
    needs = ("time",)
    whole_arm = True
    moves_arm = False
    credible = (0.01, 0.01)
    """Over all rows: a tripod that settles or warms moves by some 0.1 mm and 0.1 mrad an hour; one that moved
    farther than 10 mm or 10 mrad was knocked."""

    @property
    def names(self):
        return tuple(f"drift.{part}" for part in PARTS)

    def units(self, chain):
        return ("m/s",) * 3 + ("rad/s",) * 3

    def elements(self, chain):
        return tuple(f"base.{part if k < 3 else 'drift_' + part}" for k, part in enumerate(PARTS))

    def law(self, chain, motion, wrenches):
        return (motion.need("time", self.name) - self.reference)[:, None, None] * np.eye(len(PARTS))

    def sentence(self, chain, motion):
        speed, turning = np.linalg.norm(self.coefficients[:3]), np.linalg.norm(self.coefficients[3:])
        turned = np.rad2deg(SECONDS * turning)
        return f"The measuring frame drifts with time: {1e3 * SECONDS * speed:.3g} mm/h and {turned:.2g} °/h"

    @classmethod
    def offers(cls, arm, motion):
        """From the first row on."""
        begin = 0.0 if motion.time is None else float(np.min(motion.time))
        return offered([cls(reference=begin)], arm, motion)

    @classmethod
    def example(cls, arm, joint, rng):
        """Along and about directions that chance chooses."""
        directions = (rng.normal(size=3) for _ in range(2))
        return cls((), tuple(v for d in directions for v in (d / np.linalg.norm(d)).tolist()))

    def views(self, state):
        words, size = DRIVERS["time"]
        x = size * (state.motion.need("time", self.name) - self.reference)
        labels = [f"drift of {part} [{'mm' if k < 3 else 'mrad'}]" for k, part in enumerate(PARTS)]
        return tuple(
            view_of_element(self, state, k, what=label, driver=words, x=x) for k, label in enumerate(labels)
        )
