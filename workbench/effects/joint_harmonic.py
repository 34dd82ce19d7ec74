"""Joint harmonic: an error that repeats k times a turn, such as an eccentric (k = 1) or oval (k = 2) disc.

Δv = c cos(k q) + s sin(k q),      c, s [rad], q as the controller counts it
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.effects.effect import AbstractEffect, Insertion, Loads, driven_names, turns


@final
@dataclass(frozen=True)
class JointHarmonic(AbstractEffect):
    """Two coefficients a joint.

    Args:
        order: k, how often it repeats a turn.
    """

    order: int = 1
    name = "joint-harmonic"
    loads = Loads.NONE
    insertion = Insertion.NONE

    @property
    def names(self):
        """`joint3.cos2`, `joint3.sin2` …"""
        return tuple(f"joint{j + 1}.{word}{self.order}" for j in self.joints for word in ("cos", "sin"))

    def units(self, chain):
        """Angles."""
        return ("rad",) * len(self.names)

    def elements(self, chain):
        """What the joints drive."""
        return driven_names(chain, self.joints)

    def law(self, chain, motion, wrenches):
        """See the module."""
        rows, joints = len(motion), len(self.joints)
        angle = self.order * motion.q[:, list(self.joints)]
        out = np.zeros((rows, joints, joints, 2))
        for j in range(joints):
            out[:, j, j, 0], out[:, j, j, 1] = np.cos(angle[:, j]), np.sin(angle[:, j])
        return out.reshape(rows, joints, 2 * joints)

    def mistake(self, chain):
        """An order below 1, or a joint that slides."""
        if isinstance(self.order, bool) or not isinstance(self.order, int) or self.order < 1:
            return f"has order = {self.order!r}; give a whole number from 1"
        slides = [j + 1 for j in self.joints if not turns(chain, j)]
        return f"stands on joint {slides[0]}, which slides and has no turns" if slides else None
