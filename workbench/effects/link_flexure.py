"""Link flexure: a link (the last one: with the tool) bends and twists at its root with the moment it carries.

    Δv_x = −c_x τ'_x,      Δv_y = −c_y τ'_y,      τ' = R(v)ᵀ τ

The two rotations stand right after the driven element and turn with the link, so that a link may be softer
about one of its axes than about the other; with c_x = c_y it would be the compliance of a bearing. Where the
chain's x axis runs along the link (Hayati, DH), c_x is torsion and c_y bending [rad/(N m)].
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.effects.effect import (
    AbstractEffect,
    Insertion,
    Loads,
    across,
    driven,
    inserted_names,
    turns,
)


@final
@dataclass(frozen=True)
class LinkFlexure(AbstractEffect):
    """Two coefficients a joint, of the link after it."""

    name = "link-flexure"
    loads = Loads.ALL
    insertion = Insertion.BEND

    @property
    def names(self):
        """`joint3.flexure1`, `joint3.flexure2` …: about the axes across the joint's own, in cyclic order."""
        return tuple(f"joint{j + 1}.flexure{k}" for j in self.joints for k in (1, 2))

    def units(self, chain):
        """Angle per moment."""
        return ("rad/(N*m)",) * len(self.names)

    def elements(self, chain):
        """Two rotations a joint."""
        return inserted_names(chain, self.joints, self.insertion)

    def law(self, chain, motion, wrenches):
        """See the module."""
        turned = self._turned(chain, motion, across(chain, self.joints, wrenches)[..., None])[..., 0]
        columns = -turned.reshape(len(turned), -1)
        return columns[:, :, None] * np.eye(columns.shape[1])

    def slope(self, chain, motion, wrenches, change, constants):
        """Through the moments, and through the constant that the joint's angle contains."""
        moments = across(chain, self.joints, wrenches)
        out = self._turned(chain, motion, across(chain, self.joints, change))
        still = self._turned(chain, motion, moments[..., None])[..., 0]
        for k, joint in enumerate(self.joints):
            mine = constants == chain.index[driven(chain, joint).name]
            if turns(chain, joint) and mine.any():
                out[:, k, 0, mine] += still[:, k, 1, None]
                out[:, k, 1, mine] -= still[:, k, 0, None]
        out = out.reshape(len(out), len(self.names), -1)
        return -out * np.array(self.coefficients)[:, None]

    def _turned(self, chain, motion, moments):
        """Moments (rows, joints, 2, p) in the axes after the joints."""
        out = moments.copy()
        for k, joint in enumerate(self.joints):
            if turns(chain, joint):
                angle = motion.q[:, joint] + chain.values[chain.index[driven(chain, joint).name]]
                c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
                out[:, k, 0] = c * moments[:, k, 0] + s * moments[:, k, 1]
                out[:, k, 1] = c * moments[:, k, 1] - s * moments[:, k, 0]
        return out
