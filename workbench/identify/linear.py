"""The linear algebra that every algorithm shares: one factorisation, its rank, and what it can't see.

The whitened Jacobian is compressed to its triangular factor, whatever the number of rows. Parameters are
measured in rad and m, which weigh alike for arms of about a metre. A direction in parameter space is
*unseen* when its singular value is rounding (`RANK_TOLERANCE`), and *hardly seen* when the stated noise
leaves it uncertain by more than `HARDLY` rad or m: beyond that the model is no longer linear, and a search
along it wanders without fitting anything. No step goes along either, and both are named in the result; along
the unseen ones the parameters end as close to nominal as they can (minimum norm, as `lsqminnorm`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

RANK_TOLERANCE = 1e-10
"""Relative singular value below which a combination of parameters counts as not seen at all."""
HARDLY = 0.2
"""Standard error [rad or m] above which a combination of parameters counts as hardly seen."""


@dataclass(frozen=True, eq=False)
class Factor:
    """J = Q R, R = U S Vᵀ, and the compressed residual Qᵀr.

    Args:
        s: Singular values, largest first; zeros where rows are fewer than columns.
        vt: Right vectors, one for every parameter [rad, m].
        along: Uᵀ Qᵀ r, the residual along each left vector.
        residual_square: |r|².
    """

    s: Float[np.ndarray, " p"]
    vt: Float[np.ndarray, "p p"]
    along: Float[np.ndarray, " p"]
    residual_square: float

    @cached_property
    def visible(self) -> Bool[np.ndarray, " p"]:
        """Directions that the rows show at all, however faintly."""
        return self.s > RANK_TOLERANCE * max(float(self.s.max(initial=0.0)), 1e-300)

    @cached_property
    def uncertainty(self) -> Float[np.ndarray, " p"]:
        """Standard error along every direction [rad, m] for the stated noise."""
        return np.where(self.visible, 1.0 / np.where(self.visible, self.s, 1.0), np.inf)

    @cached_property
    def seen(self) -> Bool[np.ndarray, " p"]:
        """Directions that are identified."""
        return self.visible & (self.uncertainty < HARDLY)

    @property
    def rank(self) -> int:
        """Number of directions that are identified."""
        return int(self.seen.sum())

    @cached_property
    def null_space(self) -> Float[np.ndarray, "p n"]:
        """Directions in parameter space [rad, m] that change no row, orthonormal."""
        return self.vt[~self.visible].T

    @cached_property
    def hardly(self) -> Float[np.ndarray, "p n"]:
        """Directions that the rows show, but too faintly to identify, orthonormal."""
        return self.vt[self.visible & ~self.seen].T

    def step(self, damping: float = 0.0) -> Float[np.ndarray, " p"]:
        """Step that reduces the residual most: Gauss–Newton, or Levenberg–Marquardt if damped."""
        s = self.s[self.seen]
        return self.vt[self.seen].T @ (self.along[self.seen] * (s / (s**2 + damping)))

    def predicted_decrease(self, damping: float = 0.0) -> float:
        """Decrease of |r|² that the linear model promises for that step."""
        s2 = self.s[self.seen] ** 2
        shrink = s2 / (s2 + damping)
        return float(np.sum(self.along[self.seen] ** 2 * shrink * (2.0 - shrink)))

    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Covariance of the minimum-norm solution for unit noise."""
        half = (self.vt[self.seen] / self.s[self.seen, None]).T
        return half @ half.T

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value that counts, in rad and m."""
        return float(self.s.max() / self.s[self.seen].min()) if self.rank else np.inf


def factorise(jacobian: Float[np.ndarray, "m p"], residual: Float[np.ndarray, " m"]) -> Factor:
    """Compress and decompose a whitened Jacobian and its residual."""
    p = jacobian.shape[1]
    r = np.asarray(np.linalg.qr(np.concatenate([jacobian, residual[:, None]], axis=1), mode="r"))
    size = min(p, len(r))
    u, s, vt = np.linalg.svd(r[:size, :p])
    along = np.zeros(p)
    along[: len(s)] = (u.T @ r[:size, p])[: len(s)]
    return Factor(np.pad(s, (0, p - len(s))), vt, along, float(residual @ residual))
