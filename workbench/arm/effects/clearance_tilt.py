"""Clearance tilt: a loose bearing lets the distal link tilt by a fixed angle in the direction of the load.

    (Δv_x, Δv_y) = −c (τ_x, τ_y) / |(τ_x, τ_y)|

about the two axes across the joint's own, right before it. c [rad] is half the clearance's angle. The
direction changes quickly where the moment across the axis vanishes.

Source: Katana eqs. (4.11), (4.12), (5.15)–(5.18), with the holding moment instead of the load, and
with its exact direction: (5.16) deviates from it by up to 4.1°, and (5.15) is printed inverted.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, across, blocks, paired
from workbench.arm.effects.effect import AbstractEffect
from workbench.arm.effects.law import Law, Loads, Slope, Wrenches
from workbench.arm.motion import Motion


@final
@dataclass(frozen=True)
class ClearanceTilt(AbstractEffect):
    """One coefficient per joint."""

    name = "clearance-tilt"
    does = "the bearing of {} is loose", "the bearings of {} are loose"
    of_many_joints = True
    coefficient = "clearance"
    loads = Loads.ALL
    insertion = Insertion.TILT
    has_play = True
    credible = (0.02, 0.0)
    """Half the clearance: 0.1 mm at both ends of a bushing of 10 mm. Ball bearings have 1 mrad."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return paired(-direction_of(across(chain, self.joints, wrenches))[0])

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        direction, size = direction_of(across(chain, self.joints, wrenches))
        turning = np.eye(2) - direction[..., :, None] * direction[..., None, :]
        return blocks(-turning / size[..., None] * np.array(self.coefficients)[:, None, None])

    def sentence(self, chain: Chain, motion: Motion) -> str:
        if len(self.joints) > 1:
            return f"{self.where} have bearing clearance: they tilt with the load by up to {self.size(chain)}"
        return f"{self.where} has bearing clearance: it tilts with the load by {self.size(chain)}"


def direction_of(moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (0 for zero vectors), and lengths (infinite for zero vectors)."""
    size = np.linalg.norm(moment, axis=-1, keepdims=True)
    size = np.where(size > 0.0, size, np.inf)
    return moment / size, size
