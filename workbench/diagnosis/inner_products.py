"""The rows of a problem compressed to inner products, from which every model of effects is judged.

Columns are, in this order: the directions of the geometry that the rows show (orthonormal over all rows),
the coefficients of all candidates (scaled to unit length), and the residual that is left without any effect.
Inner products are kept for every fold of the rows, so that models can be cross-validated too: fitting,
testing and validating a model is linear algebra of its own size, whatever the number of rows.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.diagnosis.columns import candidate_columns, carriers
from workbench.identification.factorisation import factorise
from workbench.identification.problem import Problem

TETHER = 0.005
"""How far [rad, m] a model of effects may be expected to move the geometry from where it was fitted."""
SHORTEST = 1e-12
"""Columns shorter than this [whitened residual per unit] are zero."""


@dataclass(frozen=True, eq=False)
class Grams:
    """Inner products of columns.

    Args:
        names: Names of the coefficients, C of them.
        folds: Inner products within each fold; G geometric directions.
        scale: Length of every coefficient's column: scaled coefficients are SI ones times this.
        basis: The geometric directions in the unknowns that are no coefficients [rad, m], those of masses
            among them.
        prior: Inner products of what is known beforehand of the masses, which belongs to no fold.
        tether: Precision that keeps geometry near the fit where effects leave it open: within `TETHER`.
        count: Number of measured components.
    """

    names: tuple[str, ...]
    folds: Float[np.ndarray, "folds gc1 gc1"]
    scale: Float[np.ndarray, " c"]
    basis: Float[np.ndarray, "p g"]
    prior: Float[np.ndarray, "gc1 gc1"]
    tether: Float[np.ndarray, "g g"]
    count: int

    @property
    def geometry(self) -> int:
        """Number of geometric directions."""
        return self.basis.shape[1]

    @cached_property
    def total(self) -> Float[np.ndarray, "gc1 gc1"]:
        """Over all rows, with what is known beforehand."""
        return self.folds.sum(0) + self.prior

    @cached_property
    def index(self) -> dict[str, int]:
        """Column of every coefficient."""
        return {name: self.geometry + i for i, name in enumerate(self.names)}

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Columns of some coefficients."""
        return np.array([self.index[n] for n in names], np.int64)

    def scales(self, names: Sequence[str]) -> np.ndarray:
        """Scales of some coefficients."""
        return self.scale[self.columns(names) - self.geometry]


def compress(
    problem: Problem, x: Float[np.ndarray, " p"], effects: Sequence[AbstractEffect], fold: np.ndarray
) -> Grams:
    """Inner products at a problem's answer.

    Args:
        problem: Geometry, and the effects that were accepted so far.
        x: Its answer.
        effects: All that may be tried, those that were accepted included.
        fold: Fold of every row, counted from 0.
    """
    bearers = carriers(effects)
    names = tuple(name for e in bearers for name in e.names)
    plain = np.array([not p.is_coefficient for p in problem.parameters], bool)
    residual, jacobian = np.empty(problem.size), np.empty((problem.size, int(plain.sum())))
    known, off = np.zeros((0, int(plain.sum()))), np.zeros(0)
    for block, piece in problem.pieces(x):
        if block is not None:
            jacobian[block.start : block.stop] = piece.jacobian[:, plain]
            residual[block.start : block.stop] = piece.residual
        else:
            mine = piece.jacobian[:, plain].any(1)
            known, off = piece.jacobian[mine][:, plain], piece.residual[mine]
    basis = factorise(
        np.concatenate([jacobian, known]), np.concatenate([residual, off]), problem.units[plain]
    ).root
    accepted = {p.name: v for p, v in zip(problem.parameters, x.tolist(), strict=True) if p.is_coefficient}
    size = basis.shape[1] + len(names) + 1
    sums = np.zeros((int(fold.max()) + 1, size, size))
    present = np.array([accepted.get(n, 0.0) for n in names])
    for block, columns in candidate_columns(problem, x, bearers):
        rows = slice(block.start, block.stop)
        whole = residual[rows] + columns @ present
        table = np.concatenate([jacobian[rows] @ basis, columns, whole[:, None]], axis=1)
        labels = np.repeat(fold[block.rows], table.shape[0] // len(block.rows))
        for f in np.unique(labels):
            mine = table[labels == f]
            sums[f] += mine.T @ mine
    length = np.sqrt(np.maximum(np.diagonal(sums.sum(0)), 0.0))[basis.shape[1] : -1]
    scale = np.where(length > SHORTEST, length, 1.0)
    by = np.concatenate([np.ones(basis.shape[1]), scale, [1.0]])
    table = np.concatenate([known @ basis, np.zeros((len(off), len(names))), off[:, None]], axis=1)
    loose = basis[[not p.is_inertia for p in problem.parameters if not p.is_coefficient]]
    return Grams(
        names=names,
        folds=sums / np.outer(by, by),
        scale=scale,
        basis=basis,
        prior=table.T @ table,
        tether=loose.T @ loose / TETHER**2,
        count=problem.count,
    )
