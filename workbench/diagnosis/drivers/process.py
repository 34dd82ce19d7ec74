"""A function of a driver without a law: features whose weighted sum is a normal process.

    k(u, u') = exp(−|u − u'|² / 2ℓ²),      φ(u) = [u, k(u, m) k(m, m)^−½]      at knots m

Independent weights of one variance make φ·w a line and a smooth process about it, with covariance k as far as
the knots resolve it. Over a load there is a jump at zero besides: u/|u|. So the laws of a driver are special
cases of its process, which differs from them by its freedom alone. Over time it is Brownian motion, with the
eigenfunctions √2 sin(ωt) / ω, ω = (k − ½) π.

Source: Williams, Seeger, Using the Nyström method to speed up kernel machines, NIPS 13, 2001.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import Insertion, Wrenches
from workbench.arm.effects.effect import AbstractEffect, Law, Loads
from workbench.arm.motion import Motion

MAX_KNOTS, MAX_SIDE, FARTHEST = 26, 4, 1.8
"""Maximum number of knots over one number, and along each of two, and how far these reach."""
KNOTS_PER_LENGTH = 1.3
NEAR = 0.02
"""Size below which a row lies near a jump, relative to the root mean square."""
REGULAR = 1e-6
"""Added to the variance of every knot."""
TIMES = 8
"""Number of eigenfunctions over time."""

Features = Float[np.ndarray, "rows _"]


def smooth(u: Float[np.ndarray, " rows"], length: float) -> Features:
    """Features of a process over one number with correlation length `length`."""
    low, high = float(u.min()), float(u.max())
    count = int(np.clip(np.ceil(KNOTS_PER_LENGTH * (high - low) / length) + 2, 3, MAX_KNOTS))
    return _features(u[:, None], np.linspace(low, high, count)[:, None], length)


def smooth_plane(u: Float[np.ndarray, "rows 2"], length: float) -> Features:
    """Features of a process over two numbers in units of their common standard deviation."""
    line = np.linspace(-FARTHEST, FARTHEST, MAX_SIDE)
    return _features(u, np.stack(np.meshgrid(line, line), -1).reshape(-1, 2), length)


def jump(u: Float[np.ndarray, "rows d"], doubt: np.ndarray | float = 0.0) -> Features:
    """Features of a jump where one number, or both, are zero, and of each row within a doubt of there alone:
    friction and small deflections decide on its side."""
    size = np.linalg.norm(u, axis=1)
    within = NEAR * float(np.sqrt((size**2).mean())) + doubt - size
    near = [row for row in np.argsort(-within)[:MAX_KNOTS].tolist() if within[row] > 0.0]
    return np.column_stack([u / np.maximum(size, 1e-300)[:, None], np.arange(len(u))[:, None] == near])


def with_one(features: Features) -> Features:
    """The features and a constant: of a factor of another driver."""
    return np.column_stack([np.ones(len(features)), features])


def wandering(t: Float[np.ndarray, " rows"], count: int = TIMES) -> Features:
    """Features of Brownian motion over times scaled to 0 … 1, and of a line."""
    rate = (np.arange(count) + 0.5) * np.pi
    return np.column_stack([t - t.mean(), np.sqrt(2.0) * np.sin(t[:, None] * rate) / rate])


def _features(u: Float[np.ndarray, "rows d"], knots: Float[np.ndarray, "m d"], length: float) -> Features:
    def kernel(a, b):
        return np.exp(-0.5 * ((a[:, None] - b) ** 2).sum(2) / length**2)

    value, vectors = np.linalg.eigh(kernel(knots, knots) + REGULAR * np.eye(len(knots)))
    line = (u - u.mean(0)) / max(float(u.std()), 1e-300)
    return np.concatenate([line, kernel(u, knots) @ (vectors / np.sqrt(value))], axis=1)


@final
@dataclass(frozen=True, eq=False)
class DriverProcess(AbstractEffect):
    """A process that moves some elements; coefficients are its weights.

    Args:
        key: Distinguishes its coefficients from those of others.
        moved: Names of the E elements that it moves.
        together: How they move by each of D independent processes of the same features, in every row alike or
            row by row.
        features: Of some rows …
        row: … with these numbers in the file, ascending.
        kind: Rotations that its joints, or a frame, need for it.
        by_load: Whether loads drive it, so that uncertain masses act through it.
    """

    key: str = ""
    moved: tuple[str, ...] = ()
    together: Float[np.ndarray, "*rows e d"] = field(default_factory=lambda: np.eye(1))
    features: Features = field(default_factory=lambda: np.zeros((0, 0)))
    row: Int[np.ndarray, " rows"] = field(default_factory=lambda: np.zeros(0, np.int64))
    kind: Insertion = Insertion.NONE
    by_load: bool = False
    name = "driver-process"
    is_nameless = True
    is_signed = True

    @cached_property
    def names(self) -> tuple[str, ...]:
        count = self.together.shape[-1] * self.features.shape[1]
        return tuple(f"{self.key}.{k}" for k in range(count))

    @property
    def insertion(self) -> Insertion:
        return self.kind

    @property
    def loads(self) -> Loads:
        return Loads.OWN if self.by_load else Loads.NONE

    def elements(self, chain: Chain) -> tuple[str, ...]:
        return self.moved

    def law(self, chain: Chain, motion: Motion, wrenches: Wrenches) -> Law:
        assert motion.row is not None, "rows of a file have numbers"
        mine = np.searchsorted(self.row, motion.row)
        known, together = self.features[mine], self.together
        law = (together if together.ndim == 2 else together[mine])[..., None] * known[:, None, None, :]
        return law.reshape(len(known), len(self.moved), -1)

    def sentence(self, chain: Chain, motion: Motion) -> str:
        return f"An error without a law follows {self.key}"
