"""Explicit tables of columns: what inner products stand for, with nothing compressed."""

import numpy as np

from workbench.arm.effects.joint_harmonic import JointHarmonic
from workbench.diagnosis.search.gram_matrices import GEOMETRY_SIGMA, Grams

GEOMETRY, ROWS = 6, 150
FOLDS = 5
EFFECTS = [JointHarmonic((j,), order=k) for j in range(3) for k in (1, 2, 3)]
BAND = JointHarmonic((5,), order=tuple(range(1, 9)))


class Table:
    """Random columns of geometry and effects, and a residual that some of them explain.

    Args:
        seed: Of all numbers.
        loose: Length of the geometric directions in the unknowns; long ones feel their tether.
        true: Sizes of some coefficients [in units of the scaled columns].
    """

    def __init__(self, seed, *, loose=1e-7, **true):
        rng = np.random.default_rng(seed)
        self.names = tuple(n for e in (*EFFECTS, BAND) for n in e.names)
        self.geometry = np.linalg.qr(rng.standard_normal((ROWS, GEOMETRY)))[0]
        columns = rng.standard_normal((ROWS, len(self.names))) + 0.5 * rng.standard_normal((ROWS, 1))
        self.columns = columns / np.linalg.norm(columns, axis=0)
        self.scale = rng.uniform(10.0, 1000.0, len(self.names))
        self.basis = loose * rng.standard_normal((GEOMETRY + 2, GEOMETRY))
        self.fold = rng.permutation(ROWS) % FOLDS
        size = np.array([true.get(n.replace(".", "_"), 0.0) for n in self.names])
        self.left = rng.standard_normal(ROWS) + self.columns @ size
        self.left += self.geometry @ rng.standard_normal(GEOMETRY)

    @property
    def grams(self):
        """The same, compressed."""
        whole = np.column_stack([self.geometry, self.columns, self.left])
        parts = [whole[self.fold == f].T @ whole[self.fold == f] for f in range(FOLDS)]
        return Grams(self.names, np.array(parts), self.scale, self.basis, ROWS)

    def of(self, *terms):
        """Scaled columns of some terms."""
        return self.columns[:, [self.names.index(n) for t in terms for n in t.candidate.names]]

    def prior_rows(self, model):
        """Rows that hold geometry at the fit and shrunk coefficients at zero: roots of their precisions."""
        covariances = []
        for term in model:
            k = len(term.candidate.names)
            scale = self.scale[[self.names.index(n) for n in term.candidate.names]]
            root = np.zeros((k, k))
            if term.candidate.shrunk:
                prior = term.candidate.covariance * np.outer(scale, scale) / term.precision
                root = np.linalg.cholesky(np.linalg.inv(prior)).T
            covariances.append(root)
        size = sum(len(c) for c in covariances)
        rows = np.zeros((len(self.basis) + size, GEOMETRY + size))
        rows[: len(self.basis), :GEOMETRY] = self.basis / GEOMETRY_SIGMA
        at = 0
        for root in covariances:
            here = slice(at, at + len(root))
            rows[len(self.basis) :, GEOMETRY:][here, here] = root
            at += len(root)
        return rows

    def fitted(self, model, rows=None):
        """Least squares of geometry and a model on some rows, priors as further rows: the answer."""
        rows = np.ones(ROWS, bool) if rows is None else rows
        design, prior = np.column_stack([self.geometry, self.of(*model)]), self.prior_rows(model)
        target = np.concatenate([self.left[rows], np.zeros(len(prior))])
        return np.linalg.lstsq(np.vstack([design[rows], prior]), target, rcond=None)[0]

    def square(self, model, rows=None, judged=None):
        """What a fit to some rows leaves on others; without the priors' part."""
        judged = np.ones(ROWS, bool) if judged is None else judged
        design = np.column_stack([self.geometry, self.of(*model)])
        return float(((self.left - design @ self.fitted(model, rows))[judged] ** 2).sum())
