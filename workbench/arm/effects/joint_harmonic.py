"""Joint harmonic: an error that repeats k times a turn, such as an eccentric (k = 1) or oval (k = 2) disc.

    Δv = Σ_k c_k cos(k q) + s_k sin(k q),      c, s [rad], q as the controller counts it

over one order k, or over a band of orders: the teeth of a gear show with their neighbours.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from workbench.arm.effects.effect import (
    AbstractEffect,
    Insertion,
    Loads,
    driven_names,
    turns,
)


@final
@dataclass(frozen=True)
class JointHarmonic(AbstractEffect):
    """Two coefficients for every joint and order.

    Args:
        order: k, how often it repeats a turn; or several, increasing.
    """

    order: int | tuple[int, ...] = 1
    name = "joint-harmonic"
    loads = Loads.NONE
    insertion = Insertion.NONE

    @property
    def orders(self) -> tuple[int, ...]:
        """Its orders."""
        return self.order if isinstance(self.order, tuple) else (self.order,)

    @cached_property
    def names(self):
        return tuple(
            f"joint{j + 1}.{word}{k}" for j in self.joints for k in self.orders for word in ("cos", "sin")
        )

    def units(self, chain):
        return ("rad",) * len(self.names)

    def elements(self, chain):
        return driven_names(chain, self.joints)

    def law(self, chain, motion, wrenches):
        rows, joints, orders = len(motion), len(self.joints), np.array(self.orders)
        angle = motion.q[:, list(self.joints), None] * orders
        out = np.zeros((rows, joints, joints, len(orders), 2))
        for j in range(joints):
            out[:, j, j, :, 0], out[:, j, j, :, 1] = np.cos(angle[:, j]), np.sin(angle[:, j])
        return out.reshape(rows, joints, len(self.names))

    def mistake(self, chain):
        whole = all(type(k) is int and k >= 1 for k in self.orders)
        if not (whole and self.orders and list(self.orders) == sorted(set(self.orders))):
            return f"has order = {self.order!r}; give a whole number from 1, or a list of increasing ones"
        slides = [j + 1 for j in self.joints if not turns(chain, j)]
        return f"stands on joint {slides[0]}, which slides and has no turns" if slides else None
