"""How well a model of effects explains the residuals: log evidence and cross-validation.

The residual is normal with unknown variance. Free coefficients are charged as in the Bayesian information
criterion, ½ log N each; coefficients that share a variance are integrated out, their precision λ being the
one that makes the rows most likely (empirical Bayes: it shrinks what the data don't support).

    log E = −½ N' log S − ½ k log N + ½ log |Λ| − ½ log |Λ + A|

Effects are limited to physically plausible sizes: free coefficients have a prior standard deviation of half
the bound (`AbstractEffect.bounds`), shrunk ones at most that, and larger solutions are rejected.

S is the penalised sum of squares, N' the components beyond geometry and free coefficients, A what the rows
say of the shrunk coefficients once all others are fitted. Only differences are meaningful.

A model with some terms removed is computed from the whole one: with P the inverse of its Hessian, A and B
the columns that stay and go, K = P_AB P_BB⁻¹ and R = G_B + G_A K over all columns, the whole leaves R P_BB Rᵀ
less of all inner products than what stays.

Sources: Schwarz, Estimating the dimension of a model, Ann. Stat. 6(2), 1978; MacKay, Bayesian interpolation,
Neural Computation 4(3), 1992.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float, Int
from scipy import linalg
from scipy.linalg import lapack

from workbench.arm.effects import Candidate
from workbench.diagnosis.search.gram_matrices import Grams

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
CACHE_SIZE = 2
"""Size of the cache of models' residuals."""


Item = TypeVar("Item")


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
    """Residual of a model: inner products G − H diag(s) Hᵀ of all columns after projecting the model out.

    Few of them are needed, and only these are computed.

    Args:
        grams: G, of all columns.
        model: The model; shrunk coefficients are projected out partially.
        half: H, coordinates of all columns along the model's columns and the geometry …
        sign: … and s, −1 along what it lacks of a larger model.
    """

    grams: Grams
    model: Model
    half: Float[np.ndarray, "gc1 n"]
    sign: Float[np.ndarray, " n"]

    def with_more(self, model: Model, half: Float[np.ndarray, "gc1 _"], *, sign: float = 1.0) -> "Remainder":
        """The residual of a model that has further columns in H."""
        signs = np.append(self.sign, np.full(half.shape[1], sign))
        return Remainder(self.grams, model, np.concatenate([self.half, half], axis=1), signs)

    @cached_property
    def freedom(self) -> int:
        """Degrees of freedom beyond geometry and free coefficients."""
        free = sum(len(t.candidate.names) for t in self.model if not t.candidate.shrunk)
        return self.grams.count - self.grams.geometry - free

    @cached_property
    def square(self) -> float:
        return float(self.grams.total[-1, -1] - self.half[-1] ** 2 @ self.sign)

    def inner(self, columns: Int[np.ndarray, "*n k"]) -> Float[np.ndarray, "*n k k"]:
        """Inner products of some columns with each other."""
        whole, half = self.grams.total[columns[..., None], columns[..., None, :]], self.half[columns]
        return whole - (half * self.sign) @ half.swapaxes(-1, -2)

    def along(self, columns: Int[np.ndarray, "*n k"]) -> Float[np.ndarray, "*n k"]:
        """Inner products of some columns with the residual."""
        return self.grams.total[columns, -1] - self.half[columns] @ (self.sign * self.half[-1])

    def rows(self, columns: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k gc1"]:
        """Inner products of some columns with all."""
        return self.grams.total[columns] - (self.half[columns] * self.sign) @ self.half.T


@dataclass(frozen=True, eq=False)
class Offer:
    """Contribution of a candidate.

    Args:
        term: The candidate with its best precision.
        gain: Log evidence that it adds, less its handicap.
    """

    term: Term
    gain: float


def projection(grams: Grams, model: Model) -> tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]:
    """Columns that a model and the geometry use, N of them, and what makes of inner products (k, n) with them
    the coordinates (k, n) of what these explain, in an orthonormal basis."""
    used, _, block = hessian(grams, model)
    factor, scale = factored(block)

    def project(inner: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k n"]:
        return linalg.solve_triangular(factor, scale[:, None] * inner.T, lower=True, check_finite=False).T

    return used, project


def left_by(grams: Grams, model: Model) -> Remainder:
    """Fit a model and geometry and project them out of all columns."""
    used, project = projection(grams, model)
    return Remainder(grams, model, project(grams.total[used].T), np.ones(len(used)))


def offer(left: Remainder, candidate: Candidate) -> Offer | None:
    """Contribution of a candidate to a model; None if it is unobservable in the rows."""
    return next(iter(offers(left, [candidate])), None)


def offers(left: Remainder, candidates: Sequence[Candidate], *, group: Model = ()) -> list[Offer]:
    """Contributions of candidates to a model, each alone; unobservable ones are omitted.

    Masses and centres that act through the `group` of terms that they would replace also act through the
    replacement, so both are evaluated with them.
    """
    alike = grouped(candidates, lambda c: _inertia(left.grams, c, group))
    found = (_weighed(left, ones, names) if names else _offers(left, ones) for names, ones in alike.items())
    return [o for each in found for o in each]


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
    """The same with fixed masses; those of one size together, as this is faster."""
    alike = grouped(sorted(candidates, key=lambda c: not c.shrunk), lambda c: (c.shrunk, len(c.names)))
    return [o for (shrunk, _), ones in alike.items() for o in (_shrunk if shrunk else _free)(left, ones)]


def _weighed(left: Remainder, candidates: Sequence[Candidate], names: Sequence[str]) -> list[Offer]:
    """Effects of load, each together with the masses and centres that act through it."""
    columns, precision = left.grams.columns(names), np.diag(_known(left.grams, names))
    factor = linalg.cholesky(left.inner(columns) + precision, lower=True, check_finite=False)
    half = linalg.solve_triangular(factor, left.rows(columns), lower=True, check_finite=False)
    beside = left.with_more(left.model, half.T)
    charge = np.log(np.diagonal(factor)).sum() - 0.5 * np.log(np.diagonal(precision)).sum()
    taken = 0.5 * left.freedom * np.log(left.square / beside.square) - float(charge)
    return [replace(o, gain=o.gain + taken) for o in _offers(beside, candidates)]


def _known(grams: Grams, inertia: Sequence[str]) -> np.ndarray:
    """Precisions of masses and centres."""
    return np.array([grams.known[n] for n in inertia]) ** -2.0


def _free(left: Remainder, candidates: Sequence[Candidate]) -> list[Offer]:
    """Candidates with the same number of free coefficients, but for those that exceed their bounds, or act
    against their load beyond noise although they may not."""
    columns = np.stack([left.grams.columns(c.names) for c in candidates])
    largest, along = left.grams.bounds(columns), left.along(columns)
    known = expected(largest)
    value, vectors = np.linalg.eigh(left.inner(columns) + known[:, :, None] * np.eye(known.shape[1]))
    seen = value > MIN_INDEPENDENT_SHARE
    spread = vectors * np.sqrt(seen / np.where(seen, value, 1.0))[:, None]
    rank, taken = seen.sum(1), (np.einsum("nkr,nk->nr", spread, along) ** 2).sum(1)
    rest = np.maximum(left.square - taken, 1e-300)
    gain = 0.5 * left.freedom * np.log(left.square / rest) - 0.5 * rank * np.log(left.grams.count)
    found, doubt = _sizes(spread, along, rest / max(left.freedom, 1))
    gives_way = np.array([c.effect.gives_way for c in candidates])
    refused = (gives_way & (found < -doubt).any(1)) | (np.abs(found) > largest + doubt).any(1)
    usable = (rank > 0) & (left.freedom > rank + 1) & ~refused
    searched = np.log([c.tries for c in candidates])
    return [Offer(Term(candidates[i]), float(gain[i] - searched[i])) for i in np.flatnonzero(usable).tolist()]


def _sizes(spread, along, variance) -> tuple[Float[np.ndarray, "n k"], Float[np.ndarray, "n k"]]:
    """Coefficients and their tolerance: `spread` is the root of their covariance for residuals of variance 1,
    `along` what these have along them."""
    found = np.einsum("nkr,njr,nj->nk", spread, spread, along, optimize=True)
    return found, SIGN_TOLERANCE * np.sqrt(variance[:, None] * (spread**2).sum(2))


def _shrunk(left: Remainder, candidates: Sequence[Candidate]) -> list[Offer]:
    """Candidates with the same number of coefficients that share a variance: the most likely one; without
    joints that would act against their load, as free ones may not."""
    grams, columns = left.grams, np.stack([left.grams.columns(c.names) for c in candidates])
    along = left.along(columns)
    root = grams.scale[columns - grams.geometry][..., None] * np.stack([c.root for c in candidates])
    value, vectors = np.linalg.eigh(root.transpose(0, 2, 1) @ left.inner(columns) @ root)
    value = np.maximum(value, 0.0)
    spread = root @ vectors
    square = np.einsum("nkr,nk->nr", spread, along) ** 2
    seen = value > MIN_INDEPENDENT_SHARE * value.max(1, keepdims=True)
    typical = (value * seen).sum(1) / np.maximum(seen.sum(1), 1)
    widest = ((root**2).sum(2) / grams.bounds(columns) ** 2).max(1)
    tried = np.maximum(PRECISIONS * typical[:, None], widest[:, None])
    rest = left.square - (square[:, None] / (value[:, None] + tried[..., None])).sum(2)
    charge = 0.5 * np.log1p(value[:, None] / tried[..., None]).sum(2)
    gains = 0.5 * left.freedom * np.log(left.square / np.maximum(rest, 1e-300)) - charge
    out = []
    for i in np.flatnonzero((value.max(1) > MIN_INDEPENDENT_SHARE) & (left.freedom > 2)).tolist():
        candidate, best = candidates[i], int(np.argmax(gains[i]))
        precision = float(tried[i, best])
        if candidate.alike and candidate.effect.gives_way:
            variance = rest[i, [best]] / left.freedom
            found, doubt = _sizes(spread[[i]] / np.sqrt(value[i] + precision), along[[i]], variance)
            kept = np.flatnonzero(found[0] >= -doubt[0]).tolist()
            if len(kept) < len(candidate.names):
                out += _shrunk(left, [candidate.only(kept)]) if len(kept) > 1 else []
                continue
        charged = gains[i, best] - 0.5 * np.log(grams.count) - candidate.effect.handicap
        out.append(Offer(Term(candidate, precision), float(charged)))
    return out


def solve(grams: Grams, model: Model) -> Float[np.ndarray, " gc"]:
    """Scaled coefficients (and geometry steps) of a model; zeros elsewhere."""
    used, _, block = hessian(grams, model)
    out = np.zeros(grams.total.shape[0] - 1)
    out[used] = solver_of(block)(grams.total[used, -1])
    return out


def solver_of(block: Float[np.ndarray, "n n"]) -> Callable[[np.ndarray], np.ndarray]:
    """Solver for right sides (n,) or (n, k)."""
    factor, scale = factored(block)
    solved = partial(linalg.cho_solve, (factor, True), check_finite=False)
    return lambda right: (scale * solved((scale * right.T).T).T).T


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
    scaled = solve(grams, model)
    names = [n for t in model for n in t.candidate.names]
    return dict(zip(names, (scaled[grams.columns(names)] / grams.scales(names)).tolist(), strict=True))


def validated(grams: Grams, model: Model) -> Float[np.ndarray, " folds"]:
    """Sum of squares of every fold, predicted by a fit to the others."""
    return without_each_fold(grams, model)[1]


def without_each_fold(
    grams: Grams, model: Model
) -> tuple[Float[np.ndarray, "folds gc"], Float[np.ndarray, " folds"]]:
    """Solutions, as in `solve`, of fits that leave out one fold each, and the sums of squares there."""
    if (key := key_of(model)) not in grams.validated:
        used, precision, _ = hessian(grams, model)
        wide = np.append(used, len(grams.total) - 1)
        whole, found = grams.total[np.ix_(wide, wide)], np.zeros((len(grams.folds), len(grams.total) - 1))
        squares = np.empty(len(found))
        for k, mine in enumerate(fold[np.ix_(wide, wide)] for fold in grams.folds):
            inner = whole - mine
            found[k, used] = solver_of(curved(grams, inner[:-1, :-1], precision))(inner[:-1, -1])
            left = np.append(found[k, used], -1.0)
            squares[k] = left @ mine @ left
        grams.validated[key] = found, squares
    return grams.validated[key]


def jackknifed(values: Sequence[float] | Float[np.ndarray, " folds"]) -> float:
    """Jackknife standard error of a statistic computed without each fold in turn; 0 for a single fold."""
    return float(np.std(values) * np.sqrt(len(values) - 1.0))


def precision_of(grams: Grams, term: Term) -> Float[np.ndarray, "k k"]:
    """Precision matrix of a term's scaled coefficients."""
    columns = grams.columns(term.candidate.names)
    if term.candidate.covariance is None:
        return np.diag(expected(grams.bounds(columns)))
    root = grams.scale[columns - grams.geometry][:, None] * term.candidate.root
    inverse = linalg.solve_triangular(root, np.eye(len(root)), lower=True)
    return term.precision * inverse.T @ inverse


def expected(largest: Float[np.ndarray, "*n k"]) -> Float[np.ndarray, "*n k"]:
    """Prior precisions of free scaled coefficients, from their bounds."""
    return (PRIOR_SHARE * largest) ** -2.0


def compatible(candidates: Sequence[Candidate], model: Model) -> list[Candidate]:
    """Candidates that may be in a model: none that it contains, or whose joint it maps otherwise."""
    present = [t.candidate for t in model]
    taken, maps = {n for c in present for n in c.names}, [c for c in present if c.effect.maps_joint]
    mapped = {(c.effect.joints, kind) for c in maps for kind in {True, not c.shrunk}}
    free = (c for c in candidates if not (c.effect.maps_joint and (c.effect.joints, c.shrunk) in mapped))
    return [c for c in free if taken.isdisjoint(c.names)]


def curved(
    grams: Grams, block: Float[np.ndarray, "n n"], precision: Float[np.ndarray, "k k"]
) -> Float[np.ndarray, "n n"]:
    """Hessian of a model's cost in its columns, geometry first, from their inner products."""
    g = grams.geometry
    block = block.copy()
    held = grams.basis.T / grams.reach  # geometry stays near the fit where effects are confounded with it
    block[:g, :g] += held @ held.T
    block[g:, g:] += precision
    block[np.diag_indices(len(block))] += JITTER
    return block


def hessian(grams: Grams, model: Model) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns that a model uses, geometry first, the prior precision of the others, its cost's Hessian."""
    own, precision = own_columns(grams, model)
    used = np.concatenate([np.arange(grams.geometry), own])
    return used, precision, curved(grams, grams.total[np.ix_(used, used)], precision)


def own_columns(grams: Grams, model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Columns of a model's coefficients, and of masses that act through it, and their precision."""
    inertial = [n for t in model for n in grams.inertia.get(t.candidate.names, ())]
    precisions = [*(precision_of(grams, t) for t in model), np.diag(_known(grams, inertial))]
    columns = grams.columns([*(n for t in model for n in t.candidate.names), *inertial])
    return columns, linalg.block_diag(*precisions)


def key_of(model: Model) -> tuple[tuple[Candidate, float], ...]:
    """Key of a model in the caches of inner products."""
    return tuple((t.candidate, t.precision) for t in model)


def rescaled(model: Model, factor: float) -> Model:
    """The model for residuals whose squares are multiplied by a factor."""
    return tuple(Term(t.candidate, t.precision * factor) for t in model)


def grouped(some: Iterable[Item], label: Callable[[Item], Any]) -> dict[Any, list[Item]]:
    """Those with the same label together."""
    out: dict[Any, list[Item]] = {}
    for each in some:
        out.setdefault(label(each), []).append(each)
    return out


def joints_of(model: Model) -> set[int]:
    return {j for t in model for j in t.candidate.effect.joints}


def is_nameless(term: Term) -> bool:
    """Whether a term is no law."""
    effect = term.candidate.effect
    return effect.is_nameless or (term.candidate.shrunk and effect.maps_joint)


def drop(model: Model, terms: Sequence[Term]) -> Model:
    gone = {id(t) for t in terms}
    return tuple(t for t in model if id(t) not in gone)


def _places(grams: Grams, terms: Sequence[Term], used: Int[np.ndarray, " n"]) -> Int[np.ndarray, " b"]:
    """Indices of some terms among the used columns, masses that act through them included."""
    names = [n for t in terms for n in (*t.candidate.names, *grams.inertia.get(t.candidate.names, ()))]
    order = np.argsort(used)
    return order[np.searchsorted(used, grams.columns(names), sorter=order)]


def own_offers(grams: Grams, model: Model) -> list[Offer]:
    """Contribution of each of a model's terms to the others."""
    found = [offer(left_without(grams, model, (term,)), term.candidate) for term in model]
    return [o or Offer(t, -np.inf) for t, o in zip(model, found, strict=True)]


def left_of(grams: Grams, model: Model) -> Remainder:
    """As `left_by`, computed from the same model without its last term.

    A `Remainder` refers to its `Grams`: it would keep these in a cycle.
    """
    kept, key = grams.lefts, key_of(model)
    if key in kept:
        return Remainder(grams, model, kept[key], np.ones(kept[key].shape[1]))
    if model and key[:-1] in kept:
        left = with_one_more(left_of(grams, model[:-1]), model)
    else:
        left = left_by(grams, model)
    kept[key] = left.half
    for old in list(kept)[:-CACHE_SIZE]:
        del kept[old]
    return left


def left_without(grams: Grams, model: Model, group: Model) -> Remainder:
    """Residual of a model without some of its terms, given its own and the inverse of its Hessian."""
    left, key = left_of(grams, model), key_of(model)
    if key not in grams.wholes:
        grams.wholes.clear()
        used, _, block = hessian(grams, model)
        factor, scale = factored(block)
        lower, _ = lapack.dpotri(factor, lower=1)
        inverse = scale[:, None] * (np.tril(lower) + np.tril(lower, -1).T) * scale
        grams.wholes[key] = used, inverse, grams.total[used].T
    used, inverse, across = grams.wholes[key]
    places = _places(grams, group, used)
    rest, inner = np.delete(np.arange(len(used)), places), inverse[np.ix_(places, places)]
    factor, scale = factored(inner)
    taken = solver_of(inner)(inverse[np.ix_(places, rest)])
    lacking = (across[:, places] + across[:, rest] @ taken.T) @ (factor / scale[:, None])
    return left.with_more(drop(model, group), lacking, sign=-1.0)


def with_one_more(left: Remainder, model: Model) -> Remainder:
    """Residual of a model, given that of all but its last term."""
    own, precision = own_columns(left.grams, model[-1:])
    factor, scale = factored(left.inner(own) + precision + JITTER * np.eye(len(own)))
    half = linalg.solve_triangular(factor, scale[:, None] * left.rows(own), lower=True, check_finite=False)
    return left.with_more(model, half.T)
