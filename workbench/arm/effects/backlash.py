"""Backlash: a joint rests on one flank of its play or the other.

    Δv = −c tanh(τ/w),      by = "moment": the load decides; τ the holding moment about the axis
    Δv = −c direction,      by = "motion": the link lags behind the drive

c is half the play [rad or m]; w is the moment over which the joint moves from one flank to the other; for w =
0 the step is sign(τ). A diagnosis uses a small share of the moment's spread, and fixes the flanks during a
fit (`diagnosis/search/backlash_flanks.py`), since a step has no derivative. With w = 0 there may be no
equilibrium if the load changes sign within the play; such a row keeps the flank of the last iteration.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, diagonal, own
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, Loads, Slope, offered
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

CAUSES = ("moment", "motion")
LEADS = "no play is negative: the directions may have the other sign"
RELATIVE_WIDTH = 0.002
"""Width used by a diagnosis, relative to the moment's standard deviation over the rows."""


@final
@dataclass(frozen=True)
class Backlash(AbstractEffect):
    """One coefficient per joint.

    Args:
        by: `moment` or `motion`: what determines the flank.
        width: Moment over which the joint moves from one flank to the other [N m or N]; 0: a step.
    """

    by: str = "moment"
    width: float = 0.0
    name = "backlash"
    does = "{} has play to either side", "{} have play to either side"
    coefficient = "backlash"
    has_play = True
    credible = (0.03, 5e-3)
    """Half the play. Geared hobby servos have 1° in all, worn ones three times as much; industrial gears
    0.3 mrad."""

    @property
    def loads(self) -> Loads:
        return Loads.NONE if self.by == "motion" else Loads.OWN

    @property
    def needs(self) -> tuple[str, ...]:
        return ("direction",) if self.by == "motion" else ()

    @cached_property
    def names(self) -> tuple[str, ...]:
        word = "backlash_by_motion" if self.by == "motion" else "backlash"
        return tuple(f"joint{j + 1}.{word}" for j in self.joints)

    @property
    def variant(self) -> str:
        return "by motion" if self.by == "motion" else ""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        if self.by == "motion":
            return diagonal(-np.sign(motion.need("direction", self.name)[:, list(self.joints)]))
        load = own(chain, self.joints, wrenches)
        side = np.tanh(load / self.width) if self.width else np.sign(load)
        held = self._held(motion)
        return diagonal(-side if held is None else -np.where(np.isnan(held), side, held))

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        if not self.width:
            return super().slope(chain, motion, wrenches)
        steep = np.cosh(np.clip(own(chain, self.joints, wrenches) / self.width, -300.0, 300.0)) ** -2.0
        if (held := self._held(motion)) is not None:
            steep = np.where(np.isnan(held), steep, 0.0)
        return diagonal(-steep * np.array(self.coefficients) / self.width)

    def doubt(self, motion: Motion) -> str | None:
        return LEADS if min(self.coefficients) < 0.0 else None

    def sentence(self, chain: Chain, motion: Motion) -> str:
        if not max(self.coefficients) < 0.0:
            return super().sentence(chain, motion)
        size = replace(self, coefficients=tuple(-c for c in self.coefficients)).size(chain)
        return f"{self.where} goes beyond where it is told, in the direction of its motion, by {size}"

    def _held(self, motion: Motion) -> Float[np.ndarray, "rows j"] | None:
        """Flanks of its joints fixed by a fit."""
        return None if motion.flank is None else motion.flank[:, list(self.joints)]

    def softened(self, chain: Chain, wrenches: Wrenches) -> "Backlash":
        spread = float(np.std(own(chain, self.joints, wrenches))) if self.loads else 0.0
        return replace(self, width=RELATIVE_WIDTH * spread) if np.isfinite(spread) else self

    def mistake(self, chain: Chain) -> str | None:
        if self.by not in CAUSES:
            return f"has by = '{self.by}'; known: {' and '.join(CAUSES)}"
        if not self.width >= 0.0 or (self.width and self.by == "motion"):
            return f"has width = {self.width:g}; give a moment of at least 0, and 0 with by = 'motion'"
        return None

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        yield from offered([cls((j,)) for j in range(arm.dof)], arm, motion)
        reversing = [j for j in range(arm.dof) if motion.direction is None or np.ptp(motion.direction[:, j])]
        yield from offered([cls((j,), by="motion") for j in reversing or range(arm.dof)], arm, motion)

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "Backlash":
        return cls((joint,), (1.0,), by="moment" if arm.has_masses else "motion")
