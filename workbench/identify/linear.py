"""The linear algebra that every algorithm shares: one factorisation, its rank, and what it can't see.

The whitened Jacobian is compressed to its triangular factor and its columns are scaled to unit length, so
that neither the number of rows nor the choice of metres or degrees matters. Directions whose singular
value is below `RANK_TOLERANCE` of the largest can't be seen; steps along them are chosen so that the
parameters stay as close to their nominal values as the data allow (minimum norm, as `lsqminnorm`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

RANK_TOLERANCE = 1e-8
"""Relative singular value below which a combination of parameters counts as not seen at all."""


@dataclass(frozen=True, eq=False)
class Factor:
    """J = Q R, R D⁻¹ = U S Vᵀ with D the column lengths, and the compressed residual Qᵀr.

    Args:
        u: Left vectors of the compressed, scaled Jacobian.
        s: Singular values of the scaled Jacobian, largest first.
        vt: Right vectors.
        scale: Column lengths D; 1 for columns of zeros.
        compressed: Qᵀ r.
        residual_square: |r|².
    """

    u: Float[np.ndarray, "k k"]
    s: Float[np.ndarray, "k"]
    vt: Float[np.ndarray, "k p"]
    scale: Float[np.ndarray, "p"]
    compressed: Float[np.ndarray, "k"]
    residual_square: float

    @cached_property
    def rank(self) -> int:
        """Number of combinations of parameters that the rows can see."""
        return int((self.s > RANK_TOLERANCE * max(self.s[0], 1e-300)).sum()) if len(self.s) else 0

    @cached_property
    def null_space(self) -> Float[np.ndarray, "p n"]:
        """Directions in parameter space [rad, m] that change no row, orthonormal."""
        p = len(self.scale)
        if self.rank == p:
            return np.zeros((p, 0))
        _, _, vt = np.linalg.svd(self.vt[: self.rank], full_matrices=True)
        basis, _ = np.linalg.qr(vt[self.rank :].T / self.scale[:, None])
        return basis

    def step(self, damping: float = 0.0) -> Float[np.ndarray, "p"]:
        """Step that reduces the residual most: Gauss–Newton, or Levenberg–Marquardt if damped."""
        s = self.s[: self.rank]
        return self.vt[: self.rank].T @ (self._seen * (s / (s**2 + damping))) / self.scale

    def predicted_decrease(self, damping: float = 0.0) -> float:
        """Decrease of |r|² that the linear model promises for that step."""
        s2 = self.s[: self.rank] ** 2
        shrink = s2 / (s2 + damping)
        return float(np.sum(self._seen**2 * shrink * (2.0 - shrink)))

    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Covariance of the minimum-norm solution for unit noise."""
        half = self.vt[: self.rank].T / self.s[: self.rank] / self.scale[:, None]
        if self.rank < len(self.scale):
            n = self.null_space
            half = half - n @ (n.T @ half)
        return half @ half.T

    @cached_property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value that counts, columns scaled."""
        return float(self.s[0] / self.s[self.rank - 1]) if self.rank else np.inf

    @cached_property
    def _seen(self) -> Float[np.ndarray, "r"]:
        return self.u[:, : self.rank].T @ self.compressed


def factorise(jacobian: Float[np.ndarray, "m p"], residual: Float[np.ndarray, "m"]) -> Factor:
    """Compress and decompose a whitened Jacobian and its residual."""
    scale = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    scale = np.where(scale > 0.0, scale, 1.0)
    work = np.concatenate([jacobian / scale, residual[:, None]], axis=1)
    p = jacobian.shape[1]
    r = np.linalg.qr(work, mode="r")
    size = min(p, len(r))
    u, s, vt = np.linalg.svd(r[:size, :p])
    k = len(s)
    return Factor(u[:, :k], s, vt[:k], scale, r[:size, p].copy(), float(residual @ residual))
