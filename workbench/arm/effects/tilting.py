"""Bearings and guides that tilt under the moment across a joint's axis.

    (Δv_1, Δv_2) = −c s (τ_1, τ_2)                       compliance
    (Δv_1, Δv_2) = −c s (τ_1, τ_2) / |(τ_1, τ_2)|        clearance, c half of its angle

about the two axes across the joint's own, τ the holding moment. A bearing tilts right before the driven
element, with s = 1. The guide of a prismatic joint (a lift, a telescope, a linear axis) tilts right after it,
with s = q − q_0 its extension, q_0 its retracted position: a column of length s bends by s M/(E I) under a
moment M, and guides with less overlap have more clearance. The direction of a clearance changes quickly where
the moment across the axis vanishes.

Source: Katana eqs. (4.11), (4.12), (5.15)–(5.18), with the holding moment instead of the load, and
with its exact direction: (5.16) deviates from it by up to 4.1°, and (5.15) is printed inverted.
"""

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, Wrenches, across, blocks, paired, turns
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, Loads, Slope, moved_joints, offered
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot


@dataclass(frozen=True)
class AbstractTilting(AbstractEffect):
    """One coefficient per joint; a bearing of the joint itself by default."""

    loads = Loads.ALL
    insertion = Insertion.TILT
    credible = (0.02, 0.0)
    """At the largest moment (and extension) of the rows. Compliant by 1°, ball bearings would be overloaded;
    half a clearance of 0.02 rad is 0.1 mm at both ends of a bushing of 10 mm, ball bearings have 1 mrad."""

    def reach(self, motion: Motion) -> Float[np.ndarray, "rows j"]:
        """s of each joint."""
        return np.ones((len(motion), len(self.joints)))

    @abstractmethod
    def tilt(self, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tilt per unit of c s (…, 2), and its derivative in the moment (…, 2, 2)."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        return paired(-self.reach(motion)[..., None] * self.tilt(across(chain, self.joints, wrenches))[0])

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        size = self.reach(motion) * self.coefficients
        return blocks(-size[..., None, None] * self.tilt(across(chain, self.joints, wrenches))[1])


@dataclass(frozen=True)
class AbstractExtension(AbstractTilting):
    """The guide of a joint that slides.

    Args:
        retracted: Position q_0 without deflection or clearance [m].
    """

    retracted: float = 0.0
    insertion = Insertion.BEND

    def reach(self, motion: Motion) -> Float[np.ndarray, "rows j"]:
        return motion.q[:, list(self.joints)] - self.retracted

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        """At prismatic joints that moved."""
        low = arm.search_limits[:, 0].tolist()
        slides = (j for j in moved_joints(motion) if not turns(arm.chain, j))
        return offered([cls((j,), retracted=low[j]) for j in slides], arm, motion)


def proportional(moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A compliant bearing's tilt."""
    return moment, np.broadcast_to(np.eye(2), (*moment.shape, 2))


def directed(moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A loose bearing's tilt, to the side of the moment; none without one."""
    size = np.linalg.norm(moment, axis=-1, keepdims=True)
    size = np.where(size > 0.0, size, np.inf)
    side = moment / size
    return side, (np.eye(2) - side[..., :, None] * side[..., None, :]) / size[..., None]


@final
@dataclass(frozen=True)
class BearingCompliance(AbstractTilting):
    name = "bearing-compliance"
    does = "the bearing of {} gives under load", "the bearings of {} give under load"
    of_many_joints = True
    unit = ("rad/(N*m)", "")
    tilt = staticmethod(proportional)


@final
@dataclass(frozen=True)
class ClearanceTilt(AbstractTilting):
    name = "clearance-tilt"
    does = "the bearing of {} is loose", "the bearings of {} are loose"
    of_many_joints = True
    coefficient = "clearance"
    has_play = True
    tilt = staticmethod(directed)


@final
@dataclass(frozen=True)
class ExtensionCompliance(AbstractExtension):
    name = "extension-compliance"
    does = "{} tips under load as it extends", "{} tip under load as they extend"
    unit = ("rad/(N*m*m)", "")
    tilt = staticmethod(proportional)


@final
@dataclass(frozen=True)
class ExtensionClearance(AbstractExtension):
    name = "extension-clearance"
    does = "{} has play that grows as it extends", "{} have play that grows as they extend"
    unit = ("rad/m", "")
    has_play = True
    tilt = staticmethod(directed)
