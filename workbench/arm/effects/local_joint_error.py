"""Local joint error: a smooth error of one joint without a physical name, as a cubic spline through knots.

    Δv = Σ_k c_k B_k(q),      B_k the spline that is 1 at knot k and 0 at the others

Periodic splines repeat every turn (the first knot is also the last one); clamped ones have zero slope at
their ends, and are constant beyond. Outside `range`, where it was identified, the error fades out.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Float

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Wrenches, turns
from workbench.arm.effects.effect import AbstractEffect, Candidate, Law, moved_joints
from workbench.arm.effects.joint_harmonic import places
from workbench.arm.effects.valid_range import Learned, range_problem
from workbench.arm.motion import Motion

if TYPE_CHECKING:
    from workbench.arm.robot import Robot

TURN = 2.0 * np.pi
MAX_KNOTS = 40
"""Maximum number of knots in a diagnosis."""
MIN_KNOTS = 5
"""Minimum number of knots."""
MIN_ROWS_PER_KNOT = 4
"""Minimum number of rows per knot, whose height is shrunk."""
CORRELATION_LENGTHS = (1.0, 2.0, 4.0)
"""Correlation lengths to try, in knot distances."""
EXAMPLE_KNOTS = 9
"""Number of knots of an example, over the joint's limits."""


@final
@dataclass(frozen=True)
class LocalJointError(AbstractEffect):
    """One coefficient per knot, of one joint.

    Args:
        knots: Increasing joint positions [rad or m], at least three; within one turn if periodic.
        range: Minimum and maximum joint position where it was identified; from the first knot to the last if
            empty, or anywhere if periodic.
        periodic: Whether it repeats every turn.
    """

    knots: tuple[float, ...] = ()
    range: tuple[float, ...] = ()
    periodic: bool = False
    name = "local-joint-error"
    does = "{} has an error without a name", "{} have errors without a name"
    maps_joint = True
    handicap = 6.0
    credible = (0.05, 0.01)
    """Height of each knot, as of `joint-harmonic` once a turn: it has the same causes."""

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(f"joint{j + 1}.knot{k + 1}" for j in self.joints[:1] for k in range(len(self.knots)))

    @property
    def learned(self) -> Learned | None:
        if self.periodic and not self.range:
            return None
        low, high = self.range or (self.knots[0], self.knots[-1])
        return Learned(low, high, float(np.diff(self.knots).mean()))

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        q = motion.q[:, self.joints[0]]
        at = q if self.periodic else np.clip(q, self.knots[0], self.knots[-1])
        spline = _basis(self.knots, self.periodic)(at)
        return (spline if self.learned is None else spline * self.learned.weight(q)[:, None])[:, None, :]

    def bounds(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> tuple[float, ...]:
        return (self.credible[0 if turns(chain, self.joints[0]) else 1],) * len(self.names)

    def mistake(self, chain: Chain) -> str | None:
        if len(self.joints) != 1:
            return f"has {len(self.joints)} joints but needs one"
        if len(self.knots) < 3 or not (np.diff(self.knots) > 0).all():
            return f"has knots = {list(self.knots)}; give at least three, increasing"
        if wrong := range_problem(self.range):
            return wrong
        if self.periodic and not (turns(chain, self.joints[0]) and self.knots[-1] - self.knots[0] < TURN):
            return "is periodic, which needs a revolute joint and knots within one turn"
        low, high = self.range or (self.knots[0], self.knots[-1])
        if not self.periodic and not (self.knots[0] <= low and high <= self.knots[-1]):
            return f"has the range {low:g} … {high:g} beyond its knots {self.knots[0]:g} … {self.knots[-1]:g}"
        return None

    def stated(self, chain: Chain, motion: Motion, covariance: Float[np.ndarray, "c c"]) -> str:
        error = self.error_phrase(chain, motion, covariance).replace("an error", "a smooth error", 1)
        return f"{self.where} has {error} that no other effect explains"

    @classmethod
    def offers(cls, arm: "Robot", motion: Motion) -> Iterator[Candidate | str]:
        """Splines of several widths over the positions that occur."""
        for joint in moved_joints(motion):
            q = motion.q[:, joint]
            count = min(MAX_KNOTS, len(motion) // MIN_ROWS_PER_KNOT, places(q))
            if count < MIN_KNOTS:
                continue
            low, high = float(q.min()), float(q.max())
            effect = cls((joint,), knots=tuple(np.linspace(low, high, count).tolist()), range=(low, high))
            distance = np.subtract.outer(np.arange(count), np.arange(count))
            for width in CORRELATION_LENGTHS:
                covariance = np.exp(-0.5 * (distance / width) ** 2) + 1e-6 * np.eye(count)
                yield Candidate(effect, covariance)

    @classmethod
    def example(cls, arm: "Robot", joint: int, rng: np.random.Generator) -> "LocalJointError":
        bumps = rng.uniform(-1.0, 1.0, EXAMPLE_KNOTS)
        low, high = arm.search_limits[joint]
        knots = np.linspace(low, high, EXAMPLE_KNOTS)
        return cls((joint,), tuple(bumps / np.abs(bumps).max()), knots=tuple(knots))


@lru_cache(maxsize=256)
def _basis(knots: tuple[float, ...], periodic: bool) -> Callable[[np.ndarray], np.ndarray]:
    """Splines that are 1 at one knot and 0 at the others."""
    from scipy.interpolate import (
        CubicSpline,
    )  # importing it takes a third of an arm's loading time, and few arms need it

    if periodic:
        values = np.eye(len(knots))
        return CubicSpline((*knots, knots[0] + TURN), np.vstack([values, values[:1]]), bc_type="periodic")
    return CubicSpline(knots, np.eye(len(knots)), bc_type="clamped")
