"""Models with some terms removed or one added, computed from the whole model.

With P the inverse of a model's Hessian, A and B the columns that stay and go, K = P_AB P_BB⁻¹ and
R = G_B + G_A K over all columns, the whole leaves R P_BB Rᵀ less of all inner products than what stays.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Int
from scipy import linalg
from scipy.linalg import lapack

from workbench.diagnosis.search.evidence import (
    JITTER,
    Model,
    Offer,
    Remainder,
    Term,
    drop,
    factored,
    hessian,
    key_of,
    left_by,
    offer,
    own_columns,
    solver_of,
)
from workbench.diagnosis.search.gram_matrices import Grams, among

CACHE_SIZE = 2
"""Size of the cache of models' residuals."""


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
    rest, inner = np.delete(np.arange(len(used)), places), among(inverse, places)
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
