"""Linear algebra shared by all algorithms: one factorisation, its rank and its null space.

The whitened Jacobian is compressed to its triangular factor, whatever the number of rows. Every parameter is
measured in a natural unit: what changes the arm by 1 rad or 1 m, which weigh alike for arms of about a metre.
Constants have rad and m themselves; a coefficient's unit follows from its law (`Problem.units`). A direction
in parameter space is *unseen* when its singular value is rounding (`RANK_TOLERANCE`), and *weak* when
the stated noise leaves it uncertain by more than `WEAKLY_OBSERVABLE` natural units: beyond that the model is
no longer linear, and a search along it wanders without fitting anything. No step goes along either, and both
are reported in the result; along unseen directions the parameters stay as close to nominal as possible
(minimum norm, as `lsqminnorm`).
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import lapack

RANK_TOLERANCE = 1e-10
"""Relative singular value below which a combination of parameters is unobservable."""
BLOCK_SIZE = 8
"""Columns that the factorisation takes at a time: 32 take up to twice as long, as numpy does four times."""
MIN_PIVOT = 1e-11
"""Minimum pivot of the normal equations, columns scaled to 1, for sufficient accuracy."""
WEAKLY_OBSERVABLE = 0.2
"""Standard error [natural units] above which a combination of parameters is weakly observable."""


@dataclass(frozen=True, eq=False)
class Factor:
    """J D = Q R, with D the natural units, and the compressed residual Qᵀr; R = U S Vᵀ where needed.

    Args:
        r: R, upper triangular [natural units].
        compressed: Qᵀ r.
        residual_square: |r|².
        units: D, one natural unit of every parameter [rad, m, or whatever it is measured in].
    """

    r: Float[np.ndarray, "p p"]
    compressed: Float[np.ndarray, " p"]
    residual_square: float
    units: Float[np.ndarray, " p"]

    @cached_property
    def inverse(self) -> Float[np.ndarray, "p p"] | None:
        """R⁻¹ if its size alone shows that all directions are identifiable; None if the SVD must decide."""
        if not len(self.r) or np.abs(np.diagonal(self.r)).min() <= 1.0 / WEAKLY_OBSERVABLE:
            return None  # the smallest s is no greater
        found = lapack.dtrtri(self.r)[0]
        limit = min(WEAKLY_OBSERVABLE, 1.0 / (RANK_TOLERANCE * float(np.sqrt(np.vdot(self.r, self.r)))))
        if not np.vdot(found, found) < limit**2:  # its root is at least 1 / s, and that of more powers closer
            square = found.T @ found
            found = found if np.vdot(fourth := square @ square, fourth) < limit**8 else None
        return found

    def only(self, columns: Bool[np.ndarray, " p"]) -> "Factor":
        """The same for some of the parameters, with the others held."""
        found = factorise([(self.compressed, self.r[:, columns])], np.ones(np.count_nonzero(columns)))
        return replace(found, units=self.units[columns], residual_square=self.residual_square)

    @cached_property
    def svd(self) -> Any:
        """U, singular values S, the largest first, and Vh, one row per direction [natural units], of R."""
        return np.linalg.svd(self.r)

    @cached_property
    def sizes(self) -> Float[np.ndarray, " p"]:
        """These singular values; alone they take half as long."""
        return self.svd.S if "svd" in vars(self) else np.linalg.svd(self.r, compute_uv=False)

    @cached_property
    def along(self) -> Float[np.ndarray, " p"]:
        """Uᵀ Qᵀ r, the residual along each left singular vector."""
        return self.svd.U.T @ self.compressed

    @cached_property
    def visible(self) -> Bool[np.ndarray, " p"]:
        """Directions that are observable at all, however weakly."""
        if self.inverse is not None:
            return np.ones(len(self.r), bool)
        sizes = self.sizes
        return sizes > RANK_TOLERANCE * max(float(sizes.max(initial=0.0)), 1e-300)

    @cached_property
    def seen(self) -> Bool[np.ndarray, " p"]:
        """Directions that are identified: their standard error for the stated noise is 1/s."""
        if self.inverse is not None:
            return self.visible
        return self.visible & (self.sizes > 1.0 / WEAKLY_OBSERVABLE)

    @property
    def rank(self) -> int:
        """Number of directions that are identified."""
        return len(self.r) if self.inverse is not None else int(self.seen.sum())

    @cached_property
    def null_space(self) -> Float[np.ndarray, "p n"]:
        """Directions in parameter space [natural units] that change no row, orthonormal."""
        return self._some(~self.visible)

    @cached_property
    def weak(self) -> Float[np.ndarray, "p n"]:
        """Weakly observable directions [natural units], too uncertain to identify, orthonormal."""
        return self._some(self.visible & ~self.seen)

    def _some(self, wanted: Bool[np.ndarray, " p"]) -> Float[np.ndarray, "p n"]:
        return self.svd.Vh[wanted].T if wanted.any() else np.zeros((len(wanted), 0))

    def step(self, damping: float = 0.0) -> Float[np.ndarray, " p"]:
        """Step that minimises the linearised cost: Gauss–Newton, or Levenberg–Marquardt if damped."""
        if self.inverse is None:
            s = self.svd.S[self.seen]
            return self.units * (self.svd.Vh[self.seen].T @ (self.along[self.seen] * (s / (s**2 + damping))))
        if damping == 0.0:
            return self.units * (self.inverse @ self.compressed)
        damped = self.r.T @ self.r
        damped.flat[:: len(damped) + 1] += damping
        return self.units * np.linalg.solve(damped, self.r.T @ self.compressed)

    def predicted_decrease(self, step: Float[np.ndarray, " p"] | None = None) -> float:
        """Decrease of |r|² predicted by the linear model for a step; for the undamped one if None."""
        if step is None:
            explained = self.along[self.seen] if self.inverse is None else self.compressed
            return float(explained @ explained)
        explained = self.r @ (step / self.units)
        return float(explained @ (2.0 * self.compressed - explained))

    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Covariance of the minimum-norm solution for unit noise."""
        return self.root @ self.root.T

    @cached_property
    def root(self) -> Float[np.ndarray, "p r"]:
        """Square root of that covariance."""
        if self.inverse is not None:
            return self.units[:, None] * self.inverse
        return self.units[:, None] * (self.svd.Vh[self.seen] / self.svd.S[self.seen, None]).T

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value that counts, in natural units."""
        return float(self.svd.S.max() / self.svd.S[self.seen].min()) if self.rank else np.inf


def factorise(
    pieces: Iterable[tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m p"]]], units: Float[np.ndarray, " p"]
) -> Factor:
    """Compress and decompose whitened rows: each piece is folded into the triangular factor of those before.

    Args:
        pieces: Residuals and Jacobians, per unit of each parameter.
        units: Natural unit of every parameter.
    """
    p, square = len(units), 0.0
    r = np.zeros((p + 1, p + 1), order="F")
    for residual, jacobian in pieces:
        if not len(residual):
            continue
        table = np.empty((len(residual), p + 1), order="F")
        table[:, p] = residual
        np.multiply(jacobian, units, out=table[:, :p])
        r = lapack.dtpqrt(0, min(BLOCK_SIZE, p + 1), r, table, overwrite_a=True, overwrite_b=True)[0]
        square += float(residual @ residual)
    return Factor(r[:p, :p], r[:p, p], square, units)


def factorise_products(products: Float[np.ndarray, "p1 p1"], units: Float[np.ndarray, " p"]) -> Factor | None:
    """The same from the normal equations, the residual last; None if these are too inaccurate."""
    scale = np.sqrt(np.diagonal(products)[:-1])
    if not scale.all():
        return None
    lower, failed = lapack.dpotrf(products[:-1, :-1] / (scale * scale[:, None]), lower=1)
    if failed or np.diagonal(lower).min() ** 2 < MIN_PIVOT:
        return None
    compressed = lapack.dtrtrs(lower, products[:-1, -1] / scale, lower=1)[0]
    return Factor(lower.T * (scale * units), compressed, float(products[-1, -1]), units)
