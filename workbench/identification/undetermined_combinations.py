"""The linear algebra shared by all algorithms: one factorisation, its rank, and its null space.

The whitened Jacobian is compressed to its triangular factor, whatever the number of rows. Every parameter is
measured in a natural unit: what changes the arm by 1 rad or 1 m, which weigh alike for arms of about a metre.
Constants have rad and m themselves; a coefficient's unit follows from its law (`Problem.units`). A direction
in parameter space is *unseen* when its singular value is rounding (`RANK_TOLERANCE`), and *hardly seen* when
the stated noise leaves it uncertain by more than `HARDLY` natural units: beyond that the model is no longer
linear, and a search along it wanders without fitting anything. No step goes along either, and both are named
in the result; along the unseen ones the parameters end as close to nominal as they can (minimum norm, as
`lsqminnorm`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import lapack, solve_triangular

RANK_TOLERANCE = 1e-10
"""Relative singular value below which a combination of parameters counts as not seen at all."""
PANEL = 32
"""Columns that the factorisation takes at once; numpy's leaves it less room, and takes four times as long."""
PIVOT = 1e-11
"""Minimum pivot of inner products, columns scaled to 1, from which on they tell directions well enough."""
HARDLY = 0.2
"""Standard error [natural units] above which a combination of parameters counts as hardly seen."""


@dataclass(frozen=True, eq=False)
class Factor:
    """J D = Q R, R = U S Vᵀ with D the natural units, and the compressed residual Qᵀr.

    Args:
        s: Singular values, largest first; zeros where rows are fewer than columns.
        vt: Right vectors, one for every parameter [natural units].
        along: Uᵀ Qᵀ r, the residual along each left vector.
        residual_square: |r|².
        units: D, one natural unit of every parameter [rad, m, or whatever it is measured in].
    """

    s: Float[np.ndarray, " p"]
    vt: Float[np.ndarray, "p p"]
    along: Float[np.ndarray, " p"]
    residual_square: float
    units: Float[np.ndarray, " p"]

    @cached_property
    def visible(self) -> Bool[np.ndarray, " p"]:
        """Directions that the rows show at all, however faintly."""
        return self.s > RANK_TOLERANCE * max(float(self.s.max(initial=0.0)), 1e-300)

    @cached_property
    def uncertainty(self) -> Float[np.ndarray, " p"]:
        """Standard error along every direction [natural units] for the stated noise."""
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
        """Directions in parameter space [natural units] that change no row, orthonormal."""
        return self.vt[~self.visible].T

    @cached_property
    def hardly(self) -> Float[np.ndarray, "p n"]:
        """Directions [natural units] that the rows show, but too faintly to identify, orthonormal."""
        return self.vt[self.visible & ~self.seen].T

    def step(self, damping: float = 0.0) -> Float[np.ndarray, " p"]:
        """Step that reduces the residual most: Gauss–Newton, or Levenberg–Marquardt if damped."""
        s = self.s[self.seen]
        return self.units * (self.vt[self.seen].T @ (self.along[self.seen] * (s / (s**2 + damping))))

    def predicted_decrease(self, damping: float = 0.0) -> float:
        """Decrease of |r|² that the linear model promises for that step."""
        s2 = self.s[self.seen] ** 2
        shrink = s2 / (s2 + damping)
        return float(np.sum(self.along[self.seen] ** 2 * shrink * (2.0 - shrink)))

    def covariance(self) -> Float[np.ndarray, "p p"]:
        """Covariance of the minimum-norm solution for unit noise."""
        return self.root @ self.root.T

    @cached_property
    def root(self) -> Float[np.ndarray, "p r"]:
        """Square root of that covariance."""
        return self.units[:, None] * (self.vt[self.seen] / self.s[self.seen, None]).T

    def information(self) -> Float[np.ndarray, "p p"]:
        """JᵀJ: what the rows know, with zeros for what they do not."""
        half = self.s[:, None] * self.vt / self.units
        return half.T @ half

    @property
    def condition(self) -> float:
        """Ratio of the largest to the smallest singular value that counts, in natural units."""
        return float(self.s.max() / self.s[self.seen].min()) if self.rank else np.inf


def independent_columns(columns: Float[np.ndarray, "m p"], minimum: Float[np.ndarray, " p"]) -> list[int]:
    """Columns of which those kept before leave more than a minimum length, in their order."""
    basis, kept = np.zeros((len(columns), 0)), []
    for i, rest in enumerate(columns.T):
        for _ in range(2):  # once more against rounding
            rest = rest - basis @ (basis.T @ rest)
        if (length := float(np.linalg.norm(rest))) > minimum[i]:
            basis = np.column_stack([basis, rest / length])
            kept.append(i)
    return kept


def factorise(
    jacobian: Float[np.ndarray, "m p"],
    residual: Float[np.ndarray, " m"],
    units: Float[np.ndarray, " p"] | None = None,
) -> Factor:
    """Compress and decompose a whitened Jacobian and its residual.

    Args:
        jacobian: Whitened, per unit of each parameter.
        residual: Whitened.
        units: Natural unit of every parameter; 1 if None.
    """
    units = np.ones(jacobian.shape[1]) if units is None else units
    return factorise_pieces([(residual, jacobian)], units)


def factorise_pieces(
    pieces: Iterable[tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m p"]]], units: Float[np.ndarray, " p"]
) -> Factor:
    """The same for rows that come in pieces: each is folded into the triangular factor of those before.

    Args:
        pieces: Residuals and Jacobians, whitened.
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
        r = lapack.dtpqrt(0, min(PANEL, p + 1), r, table, overwrite_a=True, overwrite_b=True)[0]
        square += float(residual @ residual)
    return _decomposed(r[:p], square, units)


def _decomposed(r: Float[np.ndarray, "k p1"], square: float, units: Float[np.ndarray, " p"]) -> Factor:
    """From R and Qᵀr beside it."""
    size, p = len(r), len(units)
    u, s, vt = np.linalg.svd(r[:, :p])
    along = np.zeros(p)
    along[: len(s)] = (u.T @ r[:size, p])[: len(s)]
    return Factor(np.pad(s, (0, p - len(s))), vt, along, square, units)


def factorise_products(
    pieces: Iterable[tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m p"]]], units: Float[np.ndarray, " p"]
) -> Factor | None:
    """The same by inner products of columns, in a third of the time; None where they tell directions too
    poorly."""
    p = len(units)
    products = np.zeros((p + 1, p + 1))
    for residual, jacobian in pieces:
        table = np.column_stack([jacobian * units, residual])
        products += table.T @ table
    scale = np.sqrt(np.diagonal(products)[:p])
    if not scale.all():
        return None
    lower, failed = lapack.dpotrf(products[:p, :p] / np.outer(scale, scale), lower=1)
    if failed or np.diagonal(lower).min() ** 2 < PIVOT:
        return None
    along = solve_triangular(lower, products[:p, p] / scale, lower=True)
    return _decomposed(np.column_stack([lower.T * scale, along]), float(products[p, p]), units)
