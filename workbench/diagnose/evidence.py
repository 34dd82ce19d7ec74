"""How well a model of effects explains what the geometry leaves: log evidence, p-value, cross-validation.

The residual is normal with unknown variance. Free coefficients are charged as in the Bayesian information
criterion, ½ log N each; coefficients that share a variance are integrated out, their precision λ being the
one that makes the rows most likely (empirical Bayes: it shrinks what the data do not carry).

    log E = −½ N' log S − ½ k log N + ½ log |Λ| − ½ log |Λ + A|

S is the penalised sum of squares, N' the components beyond geometry and free coefficients, A what the rows
say of the shrunk coefficients once all others are fitted. Only differences matter.

Sources: Schwarz, Estimating the dimension of a model, Ann. Stat. 6(2), 1978; MacKay, Bayesian interpolation,
Neural Computation 4(3), 1992.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy import linalg, stats

from workbench.diagnose.candidate import Candidate
from workbench.diagnose.grams import Grams

UNSEEN = 1e-8
"""Share of a column's square beside all others below which the rows don't show it."""
PRECISIONS = np.logspace(-4.0, 8.0, 37)
"""Precisions that are tried for shrunk coefficients, relative to what the rows say of a typical one."""
JITTER = 1e-12


@dataclass(frozen=True, eq=False)
class Term:
    """A candidate in a model.

    Args:
        candidate: The effect.
        precision: λ of its shrunk coefficients, in units of the residual's variance; 0 for free ones.
    """

    candidate: Candidate
    precision: float = 0.0


Model = tuple[Term, ...]


@dataclass(frozen=True, eq=False)
class Left:
    """What a model leaves to be explained: inner products of all columns beside its own.

    Args:
        grams: Of all columns.
        model: The model.
        inner: Inner products after its columns and the geometry were fitted (shrunk ones as far as they go).
        freedom: Components beyond geometry and free coefficients.
    """

    grams: Grams
    model: Model
    inner: Float[np.ndarray, "gc1 gc1"]
    freedom: int

    @property
    def square(self) -> float:
        """Sum of squares that is left."""
        return float(self.inner[-1, -1])


@dataclass(frozen=True, eq=False)
class Offer:
    """What a candidate would bring.

    Args:
        term: The candidate with the precision that suits it best.
        gain: Log evidence that it brings, its handicap taken off.
        log_p: Logarithm of the probability that chance would bring as much.
    """

    term: Term
    gain: float
    log_p: float


def left_by(grams: Grams, model: Model) -> Left:
    """Fit a model and geometry, and take them off all columns."""
    own, precision = _own(grams, model)
    used = np.concatenate([np.arange(grams.geometry), own])
    block = grams.total[np.ix_(used, used)].copy()
    block[grams.geometry :, grams.geometry :] += precision
    block[np.diag_indices(len(used))] += JITTER
    factor = linalg.cholesky(block, lower=True, check_finite=False)
    half = linalg.solve_triangular(factor, grams.total[used], lower=True, check_finite=False)
    inner = grams.total - half.T @ half
    free = sum(len(t.candidate.names) for t in model if not t.candidate.shrunk)
    return Left(grams, model, inner, grams.count - grams.geometry - free)


def offer(left: Left, candidate: Candidate) -> Offer | None:
    """What a candidate would bring to a model; None where the rows don't show it."""
    columns = left.grams.columns(candidate.names)
    inner, along = left.inner[np.ix_(columns, columns)], left.inner[columns, -1]
    if candidate.covariance is not None:
        return _shrunk(left, candidate, inner, along)
    value, vectors = linalg.eigh(inner, check_finite=False)
    seen = value > UNSEEN
    rank = int(seen.sum())
    if not rank or left.freedom <= rank + 1:
        return None
    taken = float(((vectors.T @ along)[seen] ** 2 / value[seen]).sum())
    rest = max(left.square - taken, 1e-300)
    gain = 0.5 * left.freedom * np.log(left.square / rest) - 0.5 * rank * np.log(left.grams.count)
    ratio = (taken / rank) / (rest / (left.freedom - rank))
    log_p = float(stats.f.logsf(ratio, rank, left.freedom - rank))
    return Offer(Term(candidate), float(gain) - candidate.handicap, log_p)


def _shrunk(left: Left, candidate: Candidate, inner: np.ndarray, along: np.ndarray) -> Offer | None:
    """A candidate whose coefficients share a variance: the variance that the rows like best."""
    root = _root(left.grams, candidate)
    value, vectors = linalg.eigh(root.T @ inner @ root, check_finite=False)
    value = np.maximum(value, 0.0)
    square = (vectors.T @ (root.T @ along)) ** 2
    if value.max(initial=0.0) <= UNSEEN or left.freedom <= 2:
        return None
    tried = PRECISIONS * value[value > UNSEEN * value.max()].mean()
    rest = left.square - (square / (value + tried[:, None])).sum(1)
    charge = 0.5 * np.log1p(value / tried[:, None]).sum(1)
    gains = 0.5 * left.freedom * np.log(left.square / np.maximum(rest, 1e-300)) - charge
    best = int(np.argmax(gains))
    gain = float(gains[best])
    log_p = float(stats.chi2.logsf(2.0 * max(gain, 0.0), 2))
    charged = gain - 0.5 * float(np.log(left.grams.count)) - candidate.handicap
    return Offer(Term(candidate, float(tried[best])), charged, log_p)


def solve(grams: Grams, model: Model, inner: Float[np.ndarray, "gc1 gc1"]) -> Float[np.ndarray, " gc"]:
    """Scaled coefficients (and steps of the geometry) of a model on some inner products; zeros elsewhere."""
    own, precision = _own(grams, model)
    used = np.concatenate([np.arange(grams.geometry), own])
    block = inner[np.ix_(used, used)].copy()
    block[grams.geometry :, grams.geometry :] += precision
    block[np.diag_indices(len(used))] += 1e-9
    out = np.zeros(grams.total.shape[0] - 1)
    out[used] = linalg.solve(block, inner[used, -1], assume_a="pos", check_finite=False)
    return out


def coefficients(grams: Grams, model: Model) -> dict[str, float]:
    """Coefficients [SI] of a model's effects, all rows taken together."""
    scaled = solve(grams, model, grams.total)
    names = [n for t in model for n in t.candidate.names]
    return dict(zip(names, (scaled[grams.columns(names)] / grams.scales(names)).tolist(), strict=True))


def validated(grams: Grams, model: Model) -> Float[np.ndarray, " folds"]:
    """Sum of squares of every fold, predicted by a fit to the others."""
    out = np.empty(len(grams.folds))
    for f, fold in enumerate(grams.folds):
        found = np.append(solve(grams, model, grams.total - fold), -1.0)
        out[f] = found @ fold @ found
    return out


def precision_of(grams: Grams, term: Term) -> Float[np.ndarray, "k k"]:
    """Precision matrix of a term's scaled coefficients; zeros for free ones."""
    k = len(term.candidate.names)
    if term.candidate.covariance is None:
        return np.zeros((k, k))
    inverse = linalg.solve_triangular(_root(grams, term.candidate), np.eye(k), lower=True)
    return term.precision * inverse.T @ inverse


def _root(grams: Grams, candidate: Candidate) -> np.ndarray:
    """Lower root of the prior covariance of scaled coefficients, up to the common factor."""
    assert candidate.covariance is not None, "only shrunk candidates have one"
    scale = grams.scales(candidate.names)
    return scale[:, None] * np.linalg.cholesky(candidate.covariance)


def _own(grams: Grams, model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Columns of a model's coefficients, and their precision matrix."""
    if not model:
        return np.zeros(0, np.int64), np.zeros((0, 0))
    own = np.concatenate([grams.columns(t.candidate.names) for t in model])
    return own, linalg.block_diag(*(precision_of(grams, t) for t in model))


def drop(model: Model, terms: Sequence[Term]) -> Model:
    """A model without some of its terms."""
    gone = {id(t) for t in terms}
    return tuple(t for t in model if id(t) not in gone)


def with_precision(term: Term, precision: float) -> Term:
    """The term shrunk by another amount."""
    return replace(term, precision=precision)
