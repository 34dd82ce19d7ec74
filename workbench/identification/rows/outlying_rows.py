"""Outliers: rows that no model of the arm explains, such as mis-seated targets or mistyped numbers.

Positions, rotations and tilts are judged separately, each compared with the median residual, with leverage
taken into account: residuals of fitted rows are smaller than their errors, those of others larger.

They stand out from a robust fit, iteratively reweighted least squares: a row's weight follows from its
standardised residual under Tukey's function, with the scale from the median.

Source: Holland, Welsch, Robust regression using iteratively reweighted least-squares, 1977.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy import linalg, special
from scipy.linalg import blas

from workbench.identification.algorithms.identifier import factor_of
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.errors.row_errors import quantile
from workbench.identification.problem import LinearisedProblem, Problem

BIWEIGHT = 4.685
"""Tukey's constant: 95 % efficiency for normal errors."""
OUTLIER_CHANCE = 0.01
"""Probability of calling any row of clean normal data an outlier."""
MIN_OUTLIER_RATIO = 4.0
"""… and an outlier must exceed the median by at least this factor,"""
MIN_TAIL_RATIO, MAX_SHARE = 3.0, 0.25
"""… and the 90 % quantile by this factor, as real errors have longer tails than normal ones; or the next
smaller size, where no more than this share of the rows stands apart."""
MAX_ACCIDENTS, ALIKE = 0.4, 0.5
"""Maximum share of accidents, and what an arm of their own leaves at least: less are one side of a play."""
MIN_TOGETHER = 5
"""Number of rows that are no accidents where a fit meets them: it may follow fewer that are."""
WEIGHT_TOLERANCE = 0.05
"""Change of the weights that ends a robust fit."""
ROBUST_ROUNDS = 8
"""Maximum number of changes of the weights."""
LINEAR = 0.01
"""Error of a linearisation in stated standard deviations above which it is renewed."""


def robust_fit(
    problem: Problem, x: Float[np.ndarray, " p"]
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "rows 3"]]:
    """A fit insensitive to outliers, of rows weighed by the worse of position and rotation, and their sizes.

    A change of the weights takes one step; only where the problem is not linear enough it is searched again.

    Args:
        problem: All rows.
        x: Least-squares fit.
    """
    at, old, room = problem.evaluate(x), np.ones(len(problem.data)), np.ones(problem.size)
    step, whole = np.zeros(len(x)), np.ones(len(at.residual))
    sizes = _sizes(problem, at.residual, room)
    for _ in range(ROBUST_ROUNDS):
        worst = (sizes / _typical(sizes)).max(1)
        weights = np.maximum(1.0 - (worst / max(quantile(worst, 0.5), 1e-12) / BIWEIGHT) ** 2, 0.0)
        if np.abs(weights - old).max() < WEIGHT_TOLERANCE:
            break
        old, whole[: problem.size] = weights, weights[problem.component_rows]
        weighted = LinearisedProblem(whole * at.residual, whole[:, None] * at.jacobian)
        new = factor_of(problem, weighted).step()
        residual = problem.residual(x + new)
        if np.abs(residual - at.residual + at.jacobian @ new).max() < LINEAR:
            step = new
        else:
            x = Opt2(limit=10).search(problem.with_row_weights(weights), begin=x + step).x
            at, step = problem.evaluate(x), np.zeros(len(x))
            residual = at.residual
        sizes = _sizes(problem, residual, room)
    return x + step, sizes


def standing_out(problem: Problem, sizes: np.ndarray, share: float = MAX_SHARE) -> Bool[np.ndarray, " rows"]:
    """Rows whose sizes stand out from the others'; not where most of one payload do, which is its effect."""
    out = np.any(sizes > limits(sizes, share), axis=1)
    for load in np.unique([] if (loads := problem.data.payload) is None else loads):
        out[loads == load] &= out[loads == load].mean() <= 0.5
    return np.asarray(out)


def accidents(problem: Problem, x: Float[np.ndarray, " p"]) -> Bool[np.ndarray, " rows"]:
    """Rows that stand out from a robust fit begun at x, of many only such as have no arm in common, and that
    no fit meets with the others: all are included again, the worst left out until those that remain fit."""
    x, sizes = robust_fit(problem, x)
    out, limit = standing_out(problem, sizes, MAX_ACCIDENTS), limits(sizes, MAX_ACCIDENTS)

    def own(rows: Bool[np.ndarray, " rows"], leverage: float = 1.0) -> Float[np.ndarray, "rows 3"]:
        factor = factor_of(problem, problem.with_row_weights(rows.astype(float)).evaluate(x))
        return row_sizes(problem, x + factor.step(), rows, leverage * factor.root)

    if out.mean() > MAX_SHARE:
        out &= np.median(own(out)[out].max(1)) > ALIKE * np.median(sizes[out].max(1))
    keep = np.ones(len(out), bool)
    while count := np.count_nonzero(keep & out):
        worst = (own(keep, float(count < MIN_TOGETHER)) / limit).max(1)
        if worst[keep].max() <= 1.0:
            break
        keep &= ~out | (worst < 0.5 * worst[keep & out].max())
    return out & ~keep


def row_sizes(
    problem: Problem,
    x: Float[np.ndarray, " p"],
    fitted: Bool[np.ndarray, " rows"],
    root: Float[np.ndarray, "p r"],
) -> Float[np.ndarray, "rows 3"]:
    """Residual of every row in its channels, in stated standard deviations; 0 where not measured.

    Args:
        x: A fit to some of them.
        fitted: Which of them.
        root: Square root of the covariance of x.
    """
    room, residual = np.ones(problem.size), np.empty(problem.size)
    size = len(root)  # a triangular square root of the same covariance: half the work to multiply by
    upper = linalg.qr(np.pad(root.T, ((0, max(size - root.shape[1], 0)), (0, 0))), mode="r")[0]
    root = np.asfortranarray(upper[:size].T)
    for block, piece in problem.pieces(x):
        rows = slice(block.start, block.stop)
        residual[rows] = piece.residual
        whitened = blas.dtrmm(1.0, root, piece.jacobian.T, trans_a=1, lower=1)
        leverage = np.einsum("pm,pm->m", whitened, whitened)
        mine = fitted[problem.component_rows[rows]]
        room[rows] = np.where(mine, np.maximum(1.0 - leverage, 0.1), 1.0 + leverage)
    return _sizes(problem, residual, room)


def limits(sizes: Float[np.ndarray, "rows 3"], share: float = MAX_SHARE) -> Float[np.ndarray, " 3"]:
    """Sizes above which a row stands out."""
    ordered = np.sort(sizes, axis=0)[int((1.0 - share) * len(sizes)) :]
    gaps = np.where(ordered[1:] > MIN_TAIL_RATIO * ordered[:-1], ordered[:-1], np.inf).min(0, initial=np.inf)
    tail = MIN_TAIL_RATIO * np.minimum(quantile(sizes, 0.9), gaps)
    chance = np.sqrt(special.chdtri(3, OUTLIER_CHANCE / len(sizes)) / special.chdtri(3, 0.5))
    return np.maximum(tail, max(chance, MIN_OUTLIER_RATIO) * _typical(sizes))


def _typical(sizes: np.ndarray) -> np.ndarray:
    """Median size in each channel; next to 0 where nothing was measured."""
    return np.array([max(quantile(s[s > 0.0], 0.5), 1e-300) if s.any() else 1e-300 for s in sizes.T])


def _sizes(problem: Problem, residual: np.ndarray, room: np.ndarray) -> Float[np.ndarray, "rows 3"]:
    """Root mean square of every row's positions, rotations and tilts; 0 where not measured."""
    rows, out, residual = problem.component_rows, np.zeros((len(problem.data), 3)), residual[: problem.size]
    for channel, mine in enumerate(problem.channels):
        count = np.bincount(rows[mine], minlength=len(out))
        square = np.bincount(rows[mine], residual[mine] ** 2 / room[mine], len(out))
        out[:, channel] = np.sqrt(square / np.maximum(count, 1))
    return out
