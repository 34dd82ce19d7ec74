"""Uneven compliance: a joint deflects nonlinearly with its load, by a law without a physical name.

    Δv = −(c_1 u t + c_2 u² t + c_3 t |t|),      t = τ / τ_0,   u = (q − m) / h

τ is the holding moment about (force along) the axis, τ_0 its maximum over the identification rows; m and h
are middle and half of the joint's range there. A belt is most compliant where both free lengths are long, a
drive stiffens as it winds up. The part proportional to the load is `joint-compliance`, that with its sign is
`backlash`; both may be present as well. It predicts and names no cause. Beyond the range and 1.2 τ_0 it is
constant: from τ_0, a fit of masses would stop where its largest load bends.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, own
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, Loads, Slope, moved_joints, offered
from workbench.arm.effects.valid_range import range_problem
from workbench.arm.motion import Motion
from workbench.report.numbers import readable

if TYPE_CHECKING:
    from workbench.arm.robot import Robot


@final
@dataclass(frozen=True)
class UnevenCompliance(AbstractEffect):
    """Three coefficients, of one joint.

    Args:
        load: Maximum load τ_0 of the identification rows [N m or N]; at 0 it has no effect.
        range: Minimum and maximum joint position there [rad or m].
    """

    load: float = 0.0
    range: tuple[float, ...] = (-1.0, 1.0)
    name = "uneven-compliance"
    does = "{} gives unevenly under load", "{} give unevenly under load"
    coefficient = "uneven_along uneven_along2 uneven_load2"
    loads = Loads.OWN
    is_nameless = True
    gives_way = False
    end: ClassVar[float] = 1.2
    """Load relative to τ_0 from which it is constant."""

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        u, t, _ = self._driven(chain, motion, wrenches)
        return -np.stack([u * t, u**2 * t, t * np.abs(t)], -1)[:, None]

    def slope(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Slope:
        u, t, steep = self._driven(chain, motion, wrenches)
        by_load = np.stack([u, u**2, 2.0 * np.abs(t)], -1) @ np.array(self.coefficients)
        return -(by_load * steep)[:, None, None]

    def _driven(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> tuple[np.ndarray, ...]:
        """u, t, and the derivative of t in the load, each (rows,)."""
        low, high = self.range
        u = np.clip((2.0 * motion.q[:, self.joints[0]] - low - high) / (high - low), -1.0, 1.0)
        t = own(chain, self.joints, wrenches)[:, 0] / (self.load or np.inf)
        return u, t.clip(-self.end, self.end), (np.abs(t) < self.end) / (self.load or np.inf)

    def softened(self, chain: Chain, wrenches: Wrenches) -> "UnevenCompliance":
        maximum = float(np.abs(own(chain, self.joints, wrenches)).max(initial=0.0))
        return replace(self, load=maximum) if np.isfinite(maximum) else self

    def mistake(self, chain: Chain) -> str | None:
        if len(self.joints) != 1:
            return f"has {len(self.joints)} joints but needs one"
        if not self.load >= 0.0:
            return f"has load = {self.load:g}; give the maximum load of the identification rows"
        return range_problem(self.range) or (None if self.range else "needs the range of its joint")

    def sentence(self, chain: Chain, motion: Motion) -> str:
        u, _, _ = self._driven(chain, motion, np.zeros((*motion.q.shape, 6)))
        a, b, c = self.coefficients  # they may cancel
        load = np.linspace(0.0, 1.0, 11)
        largest = float(np.abs(load * ((a * u + b * u**2)[:, None] + c * load)).max(initial=0.0))
        size = readable(largest, self.units(chain)[0])
        return f"{self.where} deflects nonlinearly, by up to {size} beyond other effects"

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        for joint in moved_joints(motion):
            q = motion.q[:, joint]
            effect = cls((joint,), range=(float(q.min()), float(q.max())))
            yield from offered([Candidate(effect, np.eye(len(effect.names)))], arm, motion)

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "UnevenCompliance":
        low, high = arm.search_limits[joint]
        sizes = rng.uniform(-1.0, 1.0, 3)
        scaled = tuple((sizes / np.abs(sizes).max()).tolist())
        return cls((joint,), scaled, load=10.0, range=(float(low), float(high)))
