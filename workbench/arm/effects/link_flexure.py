"""Link flexure: a link (the last one with the tool) bends and twists at its root under its moment.

    Δv_x = −c_x τ'_x,      Δv_y = −c_y τ'_y,      τ' = R(v)ᵀ τ

The two rotations follow the driven element and rotate with the link, so that a link may be more compliant
about one axis than about the other; with c_x = c_y it would be the compliance of a bearing. Where the chain's
x axis runs along the link (Hayati, DH), c_x is torsion and c_y bending [rad/(N m)].
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Int

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, Wrenches, across, blocks, diagonal, turns
from workbench.arm.effects.effect import AbstractEffect, Growth, Law, Loads, Slope
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot


@final
@dataclass(frozen=True)
class LinkFlexure(AbstractEffect):
    """Two coefficients per joint, of the link after it."""

    name = "link-flexure"
    does = "the link after {} bends under load", "the links after {} bend under load"
    coefficient = "flexure1 flexure2"
    loads = Loads.ALL
    insertion = Insertion.BEND
    unit = ("rad/(N*m)", "")
    credible = (0.05, 0.0)
    """At the largest moment of the rows: a link of plastic. Aluminium yields at a tenth of it."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        turned = self._turn(chain, motion) @ across(chain, self.joints, wrenches)[..., None]
        return diagonal(-turned.reshape(len(motion), -1))

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        return blocks(-self._sizes() * self._turn(chain, motion))

    def growth(
        self, chain: Chain, motion: Motion, wrenches: Wrenches, constants: Int[np.ndarray, " p"]
    ) -> Growth:
        quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])
        moments = across(chain, self.joints, wrenches)[..., None]
        change = -self._sizes() * (quarter @ self._turn(chain, motion) @ moments)
        mine = np.array([turns(chain, j) * (constants == chain.driven[j]) for j in self.joints])
        return (change * mine[:, None]).reshape(len(motion), len(self.names), -1)

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "LinkFlexure":
        return cls((joint,), (0.5, 1.0))

    def _sizes(self) -> np.ndarray:
        """Coefficients (joints, 2, 1)."""
        return np.reshape(self.coefficients, (-1, 2, 1))

    def _turn(self, chain: Chain, motion: Motion) -> np.ndarray:
        """R(v)ᵀ (rows, joints, 2, 2), from the axes before the joints to those after them."""
        joints = list(self.joints)
        turning = [turns(chain, j) for j in joints]
        angle = np.where(turning, motion.q[:, joints] + chain.values[chain.driven[joints]], 0.0)
        c, s = np.cos(angle), np.sin(angle)
        return np.moveaxis(np.array([[c, s], [-s, c]]), (0, 1), (2, 3))
