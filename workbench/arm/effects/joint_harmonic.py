"""Joint harmonic: an error that repeats k times a turn, such as an eccentric (k = 1) or oval (k = 2) disc.

    Δv = Σ_k c_k cos(k q) + s_k sin(k q),      c, s [rad], q as the controller counts it

for one order k, or for a band of orders: gear teeth appear with neighbouring orders. A band identified on
part of a turn fades out beyond its `range`: many orders can't extrapolate.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, turns
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, moved_joints
from workbench.arm.effects.valid_range import Learned, range_problem
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

MAX_ORDER = 64
"""Maximum order."""
MIN_ROWS_PER_ORDER = 6
"""Minimum number of rows for a single order; one of a band needs twice as many."""
MIN_BAND = 16
"""Minimum highest order of a band."""
HALF_TURN = np.pi
"""Minimum range of a joint for a band [rad]; on less, a spline is equivalent."""
DECAYS = (0.0, 2.0, 4.0)
"""Powers with which the variance of a band's orders may decrease …"""
MAX_LOW_ORDER = 16.0
"""… beyond this order."""
FULL_TURN = np.deg2rad(340.0)
"""Range of a joint that counts as a full turn [rad]."""
MIN_PERIOD_SHARE = 0.9
"""Share of a period that the rows must cover for its order to be named."""
MIN_NAMED_ERRORS = 4.0
"""Minimum standard errors for an order of a band to be named."""
MAX_NAMED_ORDERS = 3
"""Maximum number of orders of a band in its sentence."""


@final
@dataclass(frozen=True)
class JointHarmonic(AbstractEffect):
    """Two coefficients for every joint and order.

    Args:
        order: k, periods per turn; or several, increasing.
        range: Minimum and maximum position of its one joint where it was identified [rad]; valid anywhere if
            empty.
    """

    order: int | tuple[int, ...] = 1
    range: tuple[float, ...] = ()
    name = "joint-harmonic"
    does = "{} has an error that varies with its angle", "{} have errors that vary with their angles"
    maps_joint = True
    credible = (0.05, 0.0)
    """Once per turn. For order k it is 1/k of that: no gear or disc runs 5 % faster in one part of a turn
    than in another. Magnetic encoders mounted off centre err by up to 3°, strain wave gears by 0.3 mrad."""
    tooth: ClassVar[float] = 5e-3
    """Minimum bound of any order [rad]: teeth of cheap gears have errors of up to 0.3°, in any number."""

    @property
    def orders(self) -> tuple[int, ...]:
        return self.order if isinstance(self.order, tuple) else (self.order,)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"joint{j + 1}.{f}{k}" for j in self.joints for k in self.orders for f in ("cos", "sin"))

    @property
    def variant(self) -> str:
        first, last = self.orders[0], self.orders[-1]
        return f"order {first}" if len(self.orders) == 1 else f"orders {first}–{last}"

    @property
    def learned(self) -> Learned | None:
        if not self.range:
            return None
        low, high = self.range
        return Learned(low, high, HALF_TURN / self.orders[-1])

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        rows, joints, each = len(motion), len(self.joints), 2 * len(self.orders)
        out = np.zeros((rows, joints, joints, each))
        for j, joint in enumerate(self.joints):
            out[:, j, j] = _waves(motion.q[:, joint], self.orders)
        if self.learned is not None:
            weight = self.learned.weight(motion.q[:, self.joints[0]])
            beyond = weight != 1.0
            out[beyond] *= weight[beyond, None, None, None]
        return out.reshape(rows, joints, joints * each)

    def mistake(self, chain: Chain) -> str | None:
        whole = all(type(k) is int and k >= 1 for k in self.orders)
        if not (whole and self.orders and list(self.orders) == sorted(set(self.orders))):
            return f"has order = {self.order!r}; give a whole number from 1, or a list of increasing ones"
        if wrong := range_problem(self.range):
            return wrong
        if self.range and len(self.joints) != 1:
            return f"has a range for {len(self.joints)} joints; give each joint a separate effect"
        slides = [j + 1 for j in self.joints if not turns(chain, j)]
        return f"needs revolute joints, but joint {slides[0]} is prismatic" if slides else None

    def stated(self, chain: Chain, motion: Motion, covariance: Float[np.ndarray, "c c"]) -> str:
        """With periods per turn only if the rows cover a whole period, and the covered part of a turn."""
        span = float(np.ptp(motion.q[:, list(self.joints)], axis=0).max())
        periods = span * self.orders[-1] / (2.0 * np.pi)
        begin = f"{self.where} has {self.error_phrase(chain, motion, covariance)} that"
        seen = f"its range of {np.rad2deg(span):.0f}°"
        if periods < MIN_PERIOD_SHARE:
            return f"{begin} varies slowly over {seen}, less than a period"
        text = f"{begin} repeats {self._times(span, covariance)}"
        if span >= FULL_TURN:
            return text
        return f"{text} (seen over {seen}{f', {periods:.1f} periods' if len(self.orders) == 1 else ''})"

    def _times(self, span: float, covariance: np.ndarray) -> str:
        """How often a turn."""
        if len(self.orders) == 1:
            (k,) = self.orders
            return {1: "once per turn", 2: "twice per turn"}.get(k, f"{k} times per turn")
        shape = (len(self.joints), len(self.orders), 2)
        squares = np.square(self.coefficients).reshape(shape).sum(2)
        variance = np.diagonal(covariance).reshape(shape).sum(2)
        whole = np.array(self.orders) * span >= MIN_PERIOD_SHARE * 2.0 * np.pi
        strength = np.where(whole & (squares >= MIN_NAMED_ERRORS**2 * variance), squares, 0.0).max(0)
        best = sorted(self.orders[i] for i in np.argsort(-strength)[:MAX_NAMED_ORDERS] if strength[i] > 0.0)
        peaks = f", most at {', '.join(map(str, best))}" if best else ""
        return f"many times per turn{peaks}"

    def bounds(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> tuple[float, ...]:
        sizes = (max(self.credible[0] / k, self.tooth) for k in self.orders)
        return tuple(size for size in sizes for _ in "cs") * len(self.joints)

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        """Each order, and a band of all orders that the rows can support."""
        for joint in moved_joints(motion):
            if not turns(arm.chain, joint):
                continue
            rows = max(len(motion) // MIN_ROWS_PER_ORDER, 2)
            highest = int(np.clip(places(motion.q[:, joint]) // 2, 2, min(MAX_ORDER, rows)))
            for order in range(1, highest + 1):
                yield Candidate(cls((joint,), order=order))
            band = min(highest, len(motion) // (2 * MIN_ROWS_PER_ORDER))
            low, high = float(motion.q[:, joint].min()), float(motion.q[:, joint].max())
            if band >= MIN_BAND and high - low > HALF_TURN:
                known = () if high - low >= FULL_TURN else (low, high)
                effect = cls((joint,), order=tuple(range(1, band + 1)), range=known)
                orders = np.repeat(np.array(effect.orders), 2)
                for decay in DECAYS:
                    yield Candidate(effect, np.diag(1.0 / (1.0 + (orders / MAX_LOW_ORDER) ** decay)))

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "JointHarmonic":
        phase = rng.uniform(0.0, 2.0 * np.pi)
        return cls((joint,), (np.cos(phase), np.sin(phase)), order=2)


def places(q: np.ndarray) -> int:
    """Number of different positions [to a milliradian or millimetre] of a joint."""
    return len(np.unique(np.round(q, 3)))


def _waves(angle: Float[np.ndarray, " rows"], orders: Sequence[int]) -> Float[np.ndarray, "rows waves"]:
    """Cosine and sine of some multiples of an angle; for many, each power of e^iq from the one before."""
    if len(orders) < MIN_BAND:
        return np.exp(1j * angle[:, None] * np.array(orders)).view(float)
    once = np.broadcast_to(np.exp(1j * angle)[:, None], (len(angle), orders[-1]))
    return np.cumprod(once, axis=1).take(np.array(orders) - 1, axis=1).view(float)
