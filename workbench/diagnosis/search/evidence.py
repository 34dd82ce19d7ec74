"""How well a model of effects explains the residuals: log evidence, p-value, cross-validation.

The residual is normal with unknown variance. Free coefficients are charged as in the Bayesian information
criterion, ½ log N each; coefficients that share a variance are integrated out, their precision λ being the
one that makes the rows most likely (empirical Bayes: it shrinks what the data don't support).

    log E = −½ N' log S − ½ k log N + ½ log |Λ| − ½ log |Λ + A|

Effects are limited to physically plausible sizes: free coefficients have a prior standard deviation of half
the bound (`AbstractEffect.bounds`), shrunk ones at most that, and larger solutions are rejected.

S is the penalised sum of squares, N' the components beyond geometry and free coefficients, A what the rows
say of the shrunk coefficients once all others are fitted. Only differences are meaningful.

Sources: Schwarz, Estimating the dimension of a model, Ann. Stat. 6(2), 1978; MacKay, Bayesian interpolation,
Neural Computation 4(3), 1992.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy import linalg, special

from workbench.arm.effects import Candidate
from workbench.diagnosis.search.gram_matrices import Grams, among

MIN_INDEPENDENT_SHARE = 1e-5
"""Share of a column's square independent of all others below which it is unobservable."""
PRECISIONS = np.logspace(-4.0, 8.0, 37)
"""Precisions to try for shrunk coefficients, relative to the information of the rows on a typical one."""
JITTER = 1e-10
JITTERS = (1e-12, 1e-9, 1e-6)
SIGN_TOLERANCE = 2.0
"""Tolerance in standard errors for coefficients that can't be negative."""
PRIOR_SHARE = 0.5
"""Prior standard deviation of coefficients as a share of their bound."""
NONZERO_ERRORS = 3.0
"""Standard errors below which a coefficient is compatible with zero."""
MIN_F_RATIO = 4.0
"""F ratios below this are never significant; their p-value is not computed."""


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
class Remainder:
    """Residual of a model: inner products of all columns after projecting the model out.

    Args:
        grams: Of all columns.
        model: The model.
        inner: Inner products after fitting its columns and the geometry (shrunk ones partially).
        freedom: Degrees of freedom beyond geometry and free coefficients.
    """

    grams: Grams
    model: Model
    inner: Float[np.ndarray, "gc1 gc1"]
    freedom: int

    @classmethod
    def of(cls, grams: Grams, model: Model, inner: Float[np.ndarray, "gc1 gc1"]) -> "Remainder":
        free = sum(len(t.candidate.names) for t in model if not t.candidate.shrunk)
        return cls(grams, model, inner, grams.count - grams.geometry - free)

    @property
    def square(self) -> float:
        return float(self.inner[-1, -1])


@dataclass(frozen=True, eq=False)
class Offer:
    """Contribution of a candidate.

    Args:
        term: The candidate with its best precision.
        gain: Log evidence that it adds, less its handicap.
        log_p: Logarithm of the probability that chance would add as much.
    """

    term: Term
    gain: float
    log_p: float


def projection(grams: Grams, model: Model) -> Callable[[np.ndarray], np.ndarray]:
    """Maps inner products (n, gc1) of n columns with all others to the coordinates (used, n) that a model and
    the geometry explain, in an orthonormal basis."""
    own, precision = own_columns(grams, model)
    used = np.concatenate([np.arange(grams.geometry), own])
    factor, scale = factored(curved(grams, among(grams.total, used), precision))
    return lambda inner: linalg.solve_triangular(
        factor, scale[:, None] * inner[:, used].T, lower=True, check_finite=False
    )


def left_by(grams: Grams, model: Model, only: Sequence[str] | None = None) -> Remainder:
    """Fit a model and geometry and project them out of all columns, or of those of one effect."""
    project = projection(grams, model)
    if only is None:
        half = project(grams.total)
        return Remainder.of(grams, model, grams.total - half.T @ half)
    requested = np.append(grams.columns((*only, *grams.inertia.get(tuple(only), ()))), len(grams.total) - 1)
    half, inner = project(grams.total[requested]), np.zeros_like(grams.total)
    inner[np.ix_(requested, requested)] = grams.total[np.ix_(requested, requested)] - half.T @ half
    return Remainder.of(grams, model, inner)


def offer(left: Remainder, candidate: Candidate) -> Offer | None:
    """Contribution of a candidate to a model; None if it is unobservable in the rows."""
    return next(iter(offers(left, [candidate])), None)


def offers(left: Remainder, candidates: Sequence[Candidate], *, group: Model = ()) -> list[Offer]:
    """Contributions of candidates to a model, each alone; unobservable ones are omitted.

    Args:
        left: Residual of the model.
        candidates: The candidates.
        group: Terms that they would replace. Masses and centres that act through these also act through the
            replacement, so both are evaluated with them.
    """
    alike: dict[tuple[str, ...], list[Candidate]] = {}
    for c in candidates:
        alike.setdefault(_inertia(left.grams, c, group), []).append(c)
    return [
        o
        for names, ones in alike.items()
        for o in (_weighed(left, ones, names) if names else _offers(left, ones))
    ]


def _inertia(grams: Grams, candidate: Candidate, group: Model) -> tuple[str, ...]:
    """Columns of masses and centres that go with a candidate in place of some terms.

    They act through every effect of load, and through other joints of the same kind of effect; backlash
    depends only on the load's sign.
    """
    shared = tuple(
        n
        for t in group
        if (_follows_load(candidate) and _follows_load(t.candidate))
        or candidate.effect.name == t.candidate.effect.name
        for n in grams.inertia.get(t.candidate.names, ())
    )
    return shared or grams.inertia.get(candidate.names, ())


def _follows_load(candidate: Candidate) -> bool:
    return bool(candidate.effect.loads and not candidate.effect.has_play)


def _offers(left: Remainder, candidates: Sequence[Candidate]) -> list[Offer]:
    """The same with fixed masses."""
    found = [o for c in candidates if c.shrunk and (o := _shrunk(left, c)) is not None]
    sizes: dict[int, list[Candidate]] = {}
    for c in candidates:
        if not c.shrunk:
            sizes.setdefault(len(c.names), []).append(c)
    for alike in sizes.values():
        found += _free(left, alike)
    return found


def _weighed(left: Remainder, candidates: Sequence[Candidate], names: Sequence[str]) -> list[Offer]:
    """Effects of load, each together with the masses and centres that act through it.

    Without the effect they would not act, so chance is computed for both together: evidence of e^g occurs by
    chance in at most e^-g of all arms (Markov's inequality).
    """
    columns = left.grams.columns(names)
    precision = np.diag(_known(left.grams, names))
    block = left.inner[np.ix_(columns, columns)]
    factor = linalg.cholesky(block + precision, lower=True, check_finite=False)
    mine = np.append(left.grams.columns([n for c in candidates for n in c.names]), left.inner.shape[0] - 1)
    half = linalg.solve_triangular(factor, left.inner[np.ix_(columns, mine)], lower=True, check_finite=False)
    inner = left.inner.copy()
    inner[np.ix_(mine, mine)] -= half.T @ half
    beside = replace(left, inner=inner)
    charge = np.log(np.diagonal(factor)).sum() - 0.5 * np.log(np.diagonal(precision)).sum()
    taken = 0.5 * left.freedom * np.log(left.square / beside.square) - float(charge)
    gains = [(o, o.gain + taken) for o in _offers(beside, candidates)]
    return [replace(o, gain=gain, log_p=min(o.log_p, -gain)) for o, gain in gains]


def _known(grams: Grams, inertia: Sequence[str]) -> np.ndarray:
    """Precisions of masses and centres."""
    return np.array([grams.known[n] for n in inertia]) ** -2.0


def _free(left: Remainder, candidates: Sequence[Candidate]) -> list[Offer]:
    """Candidates with the same number of free coefficients."""
    columns = np.stack([left.grams.columns(c.names) for c in candidates])
    inner = left.inner[columns[:, :, None], columns[:, None, :]]
    known = expected(left.grams, candidates)
    value, vectors = np.linalg.eigh(inner + known[:, :, None] * np.eye(known.shape[1]))
    along = (vectors.transpose(0, 2, 1) @ left.inner[columns, -1, None])[..., 0]
    seen = value > MIN_INDEPENDENT_SHARE
    rank = seen.sum(1)
    taken = np.where(seen, along**2 / np.where(seen, value, 1.0), 0.0).sum(1)
    rest = np.maximum(left.square - taken, 1e-300)
    gain = 0.5 * left.freedom * np.log(left.square / rest) - 0.5 * rank * np.log(left.grams.count)
    size = np.where(seen, along / np.where(seen, value, 1.0), 0.0)
    refused = _refused(candidates, value, vectors, size, rest, left)
    usable = (rank > 0) & (left.freedom > rank + 1) & ~refused
    searched = np.log([c.tries for c in candidates])
    return [
        Offer(
            Term(candidates[int(i)]),
            float(gain[i] - searched[i]),
            _log_p(taken[i], rest[i], int(rank[i]), left.freedom) + float(searched[i]),
        )
        for i in np.flatnonzero(usable)
    ]


def _refused(candidates, value, vectors, size, rest, left) -> np.ndarray:
    """Candidates that exceed their bounds, or act against their load beyond noise although they may not."""
    found = (vectors @ size[..., None])[..., 0]
    inverse = np.where(value > MIN_INDEPENDENT_SHARE, 1.0 / np.maximum(value, MIN_INDEPENDENT_SHARE), 0.0)
    spread = np.sqrt((vectors**2 @ inverse[..., None])[..., 0] * (rest / max(left.freedom, 1))[:, None])
    gives_way = np.array([c.effect.gives_way for c in candidates])
    pushes = gives_way & (found < -SIGN_TOLERANCE * spread).any(1)
    largest = np.array([left.grams.bounds(c.names) for c in candidates])
    return pushes | (np.abs(found) > largest + SIGN_TOLERANCE * spread).any(1)


def _log_p(taken: float, rest: float, rank: int, freedom: int) -> float:
    """Logarithm of the F test's p-value."""
    ratio = (taken / rank) / (rest / (freedom - rank))
    if ratio < MIN_F_RATIO:
        return 0.0
    with np.errstate(divide="ignore"):
        return float(np.log(special.fdtrc(rank, freedom - rank, ratio)))


def _shrunk(left: Remainder, candidate: Candidate) -> Offer | None:
    """A candidate whose coefficients share a variance: the most likely one."""
    columns = left.grams.columns(candidate.names)
    inner, along = left.inner[np.ix_(columns, columns)], left.inner[columns, -1]
    root = _root(left.grams, candidate)
    value, vectors = linalg.eigh(root.T @ inner @ root, check_finite=False)
    value = np.maximum(value, 0.0)
    square = (vectors.T @ (root.T @ along)) ** 2
    if value.max(initial=0.0) <= MIN_INDEPENDENT_SHARE or left.freedom <= 2:
        return None
    widest = (root**2).sum(1) / left.grams.bounds(candidate.names) ** 2
    tried = np.maximum(PRECISIONS * value[value > MIN_INDEPENDENT_SHARE * value.max()].mean(), widest.max())
    rest = left.square - (square / (value + tried[:, None])).sum(1)
    charge = 0.5 * np.log1p(value / tried[:, None]).sum(1)
    gains = 0.5 * left.freedom * np.log(left.square / np.maximum(rest, 1e-300)) - charge
    best = int(np.argmax(gains))
    gain = float(gains[best])
    if pushing := _pushing_joints(
        candidate, vectors, value, tried[best], root, along, rest[best] / left.freedom
    ):
        kept = [i for i in range(len(candidate.names)) if i not in pushing]
        return _shrunk(left, candidate.only(kept)) if len(kept) > 1 else None
    log_p = -max(gain, 0.0)  # of twice the gain, by the chi-squared distribution with two degrees of freedom
    charged = gain - 0.5 * float(np.log(left.grams.count)) - candidate.effect.handicap
    return Offer(Term(candidate, float(tried[best])), charged, log_p)


def _pushing_joints(candidate, vectors, value, precision, root, along, variance) -> set[int]:
    """Indices of the coefficients that would act against their load, as in `_refused`."""
    if not (candidate.alike and candidate.effect.gives_way):
        return set()
    spread = root @ vectors / np.sqrt(value + precision)
    found = spread @ (spread.T @ along)
    return set(np.flatnonzero(found < -SIGN_TOLERANCE * np.sqrt(variance * (spread**2).sum(1))).tolist())


def solve(grams: Grams, model: Model, inner: Float[np.ndarray, "gc1 gc1"]) -> Float[np.ndarray, " gc"]:
    """Scaled coefficients (and geometry steps) of a model for some inner products; zeros elsewhere."""
    own, precision = own_columns(grams, model)
    used = np.concatenate([np.arange(grams.geometry), own])
    block = curved(grams, among(inner, used), precision)
    out = np.zeros(grams.total.shape[0] - 1)
    out[used] = solver_of(block)(inner[used, -1])
    return out


def curvature(
    grams: Grams, model: Model
) -> tuple[Callable[[np.ndarray], np.ndarray], Float[np.ndarray, "n n"]]:
    """Solver and matrix for the Hessian of a cost in geometry steps and scaled coefficients.

    Masses and centres are fixed.
    """
    own, precision = own_columns(grams, model, inertia=False)
    used = np.concatenate([np.arange(grams.geometry), own])
    block = curved(grams, among(grams.total, used), precision)
    return solver_of(block), block


def solver_of(block: Float[np.ndarray, "n n"]) -> Callable[[np.ndarray], np.ndarray]:
    """Solver for right sides (n,) or (n, k)."""
    factor, scale = factored(block)
    return lambda right: (
        (scale * linalg.cho_solve((factor, True), (scale * right.T).T, check_finite=False).T).T
    )


def factored(block: Float[np.ndarray, "n n"]) -> tuple[Float[np.ndarray, "n n"], Float[np.ndarray, " n"]]:
    """Lower root of a Hessian whose diagonal was scaled to 1, and the scale.

    Its own diagonal spans as much as the precisions, some 20 orders of magnitude, too many for a
    factorisation. If rounding makes it indefinite, a little is added to the diagonal.
    """
    scale = 1.0 / np.sqrt(np.diagonal(block))
    scaled = scale[:, None] * block
    scaled *= scale
    for jitter in (0.0, *JITTERS):
        try:
            scaled[np.diag_indices(len(scaled))] = 1.0 + jitter
            return linalg.cholesky(scaled.T, lower=True, check_finite=False), scale  # in Fortran order
        except linalg.LinAlgError:
            continue
    raise linalg.LinAlgError("a Hessian is indefinite beyond rounding")


def coefficients(grams: Grams, model: Model) -> dict[str, float]:
    """Coefficients [SI] of a model's effects from all rows together."""
    scaled = solve(grams, model, grams.total)
    names = [n for t in model for n in t.candidate.names]
    return dict(zip(names, (scaled[grams.columns(names)] / grams.scales(names)).tolist(), strict=True))


def validated(grams: Grams, model: Model) -> Float[np.ndarray, " folds"]:
    """Sum of squares of every fold, predicted by a fit to the others."""
    key = tuple((t.candidate, t.precision) for t in model)
    if key not in grams.validated:
        whole = np.column_stack([without_each_fold(grams, model), -np.ones(len(grams.folds))])
        grams.validated[key] = np.array([w @ fold @ w for w, fold in zip(whole, grams.folds, strict=True)])
    return grams.validated[key]


def without_each_fold(grams: Grams, model: Model) -> Float[np.ndarray, "folds gc"]:
    """Solutions, as in `solve`, of fits that leave out one fold each."""
    own, precision = own_columns(grams, model)
    used = np.concatenate([np.arange(grams.geometry), own])
    wide = np.append(used, len(grams.total) - 1)
    whole, out = among(grams.total, wide), np.zeros((len(grams.folds), len(grams.total) - 1))
    for found, fold in zip(out, grams.folds, strict=True):
        inner = whole - among(fold, wide)
        found[used] = solver_of(curved(grams, inner[:-1, :-1], precision))(inner[:-1, -1])
    return out


def differs(
    grams: Grams, term: Term, whole: Float[np.ndarray, " gc"], parts: Float[np.ndarray, "folds gc"]
) -> bool:
    """Whether a term's scaled coefficients differ from zero, judged by their variation over folds.

    Args:
        whole: The solution of a model with the term.
        parts: Solutions that leave out one fold each.
    """
    mine = grams.columns(term.candidate.names)
    size = whole[mine]
    return bool(size @ size > NONZERO_ERRORS * jackknifed(parts[:, mine] @ size))


def jackknifed(values: Sequence[float] | Float[np.ndarray, " folds"]) -> float:
    """Jackknife standard error of a statistic computed without each fold in turn; 0 for a single fold."""
    return float(np.std(values) * np.sqrt(len(values) - 1.0))


def precision_of(grams: Grams, term: Term) -> Float[np.ndarray, "k k"]:
    """Precision matrix of a term's scaled coefficients."""
    k = len(term.candidate.names)
    if term.candidate.covariance is None:
        return np.diag(expected(grams, [term.candidate])[0])
    inverse = linalg.solve_triangular(_root(grams, term.candidate), np.eye(k), lower=True)
    return term.precision * inverse.T @ inverse


def expected(grams: Grams, candidates: Sequence[Candidate]) -> Float[np.ndarray, "n k"]:
    """Prior precisions of free scaled coefficients, from their bounds."""
    return np.array([(PRIOR_SHARE * grams.bounds(c.names)) ** -2.0 for c in candidates])


def _root(grams: Grams, candidate: Candidate) -> np.ndarray:
    """Lower root of the prior covariance of scaled coefficients, up to the common factor."""
    return grams.scales(candidate.names)[:, None] * candidate.root


def curved(
    grams: Grams, block: Float[np.ndarray, "n n"], precision: Float[np.ndarray, "k k"]
) -> Float[np.ndarray, "n n"]:
    """Hessian of a model's cost in its columns, geometry first, from their inner products."""
    g = grams.geometry
    block = block.copy()
    block[:g, :g] += grams.tether
    block[g:, g:] += precision
    block[np.diag_indices(len(block))] += JITTER
    return block


def own_columns(grams: Grams, model: Model, *, inertia: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Columns of a model's coefficients and of the masses that act through it, and their precision."""
    if not model:
        return np.zeros(0, np.int64), np.zeros((0, 0))
    names = [t.candidate.names for t in model]
    columns, precisions = [grams.columns(n) for n in names], [precision_of(grams, t) for t in model]
    if inertia:
        inertial = [n for each in names for n in grams.inertia.get(each, ())]
        columns.append(grams.columns(inertial))
        precisions.append(np.diag(_known(grams, inertial)))
    return np.concatenate(columns), linalg.block_diag(*precisions)


def rescaled(model: Model, factor: float) -> Model:
    """The model for residuals whose squares are multiplied by a factor."""
    return tuple(Term(t.candidate, t.precision * factor) for t in model)


def joints_of(model: Model) -> set[int]:
    return {j for t in model for j in t.candidate.effect.joints}


def drop(model: Model, terms: Sequence[Term]) -> Model:
    gone = {id(t) for t in terms}
    return tuple(t for t in model if id(t) not in gone)


def standard_error(values: Float[np.ndarray, " folds"]) -> float:
    """Standard error of the mean over folds; 0 for a single fold."""
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0
