"""Models with some terms removed or one added, computed from the whole model.

With H the Hessian of a model, P its inverse and x its solution, the reduced model A without the columns B has
the solution x_A − K x_B with K = P_AB P_BB⁻¹; of the inner products G it leaves for B those of G_BB + G_BA K.
With R = G_B + G_A K over all columns, the whole leaves R P_BB Rᵀ less of all inner products than the reduced
model.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy import linalg
from scipy.linalg import lapack

from workbench.diagnosis.search.evidence import (
    JITTER,
    Model,
    Offer,
    Remainder,
    Term,
    curved,
    drop,
    factored,
    key_of,
    left_by,
    offer,
    own_columns,
    solver_of,
    used_columns,
)
from workbench.diagnosis.search.gram_matrices import Grams, among

CACHE_SIZE = 2
"""Size of the cache of models' residuals."""


class _Whole:
    """A model fitted to inner products, from which terms can be removed.

    Args:
        inner: Inner products of the columns that it uses, the residual last.
        precision: Of the model's coefficients.
    """

    def __init__(self, grams: Grams, inner: Float[np.ndarray, "n1 n1"], precision: np.ndarray):
        factor, scale = factored(curved(grams, inner[:-1, :-1], precision))
        lower, _ = lapack.dpotri(factor, lower=1)
        inverse = np.tril(lower) + np.tril(lower, -1).T
        self._inverse = scale[:, None] * inverse * scale
        self._found = self._inverse @ inner[:-1, -1]

    def returned(
        self, places: Int[np.ndarray, " b"], across: Float[np.ndarray, "c n"]
    ) -> Float[np.ndarray, "c b"]:
        """Coordinates of all columns along what the reduced model lacks.

        Args:
            places: Indices of the removed columns.
            across: Inner products of all columns with those that the whole uses.
        """
        rest = np.delete(np.arange(len(self._found)), places)
        inner = among(self._inverse, places)
        factor, scale = factored(inner)
        taken = solver_of(inner)(self._inverse[np.ix_(places, rest)])
        return (across[:, places] + across[:, rest] @ taken.T) @ (factor / scale[:, None])

    def without(self, places: Int[np.ndarray, " b"]) -> Float[np.ndarray, " n"]:
        """Solution of the reduced model, zero for removed columns."""
        rest = np.delete(np.arange(len(self._found)), places)
        found = np.zeros(len(self._found))
        taken = solver_of(among(self._inverse, places))(self._found[places])
        found[rest] = self._found[rest] - self._inverse[np.ix_(rest, places)] @ taken
        return found


def _places(grams: Grams, terms: Sequence[Term], used: Int[np.ndarray, " n"]) -> Int[np.ndarray, " b"]:
    """Indices of some terms among the used columns, masses that act through them included."""
    names = [n for t in terms for n in (*t.candidate.names, *grams.inertia.get(t.candidate.names, ()))]
    order = np.argsort(used)
    return order[np.searchsorted(used, grams.columns(names), sorter=order)]


def own_offers(grams: Grams, model: Model) -> list[Offer]:
    """Contribution of each of a model's terms to the others."""
    found = [offer(left_without(grams, model, (term,)), term.candidate) for term in model]
    return [o or Offer(t, -np.inf) for t, o in zip(model, found, strict=True)]


def validated_without(
    grams: Grams, model: Model, groups: Sequence[Model]
) -> Float[np.ndarray, "groups folds"]:
    """Sums of squares, as in `validated`, of a model without each of some groups of its terms."""
    used, precision = used_columns(grams, model)
    wide = np.append(used, len(grams.total) - 1)
    total, out = among(grams.total, wide), np.empty((len(groups), len(grams.folds)))
    places = [_places(grams, group, used) for group in groups]
    for k, fold in enumerate(grams.folds):
        mine = among(fold, wide)
        whole = _Whole(grams, total - mine, precision)
        for g, gone in enumerate(places):
            left = np.append(whole.without(gone), -1.0)
            out[g, k] = left @ mine @ left
    return out


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
    """Residual of a model without some of its terms."""
    left, key, (used, precision) = left_of(grams, model), key_of(model), used_columns(grams, model)
    if key not in grams.wholes:
        grams.wholes.clear()
        inner = among(grams.total, np.append(used, len(grams.total) - 1))
        grams.wholes[key] = _Whole(grams, inner, precision), grams.total[used].T
    whole, across = grams.wholes[key]
    returned = whole.returned(_places(grams, group, used), across)
    return left.with_more(drop(model, group), returned, sign=-1.0)


def with_one_more(left: Remainder, model: Model) -> Remainder:
    """Residual of a model, given that of all but its last term."""
    own, precision = own_columns(left.grams, model[-1:])
    factor, scale = factored(left.inner(own) + precision + JITTER * np.eye(len(own)))
    half = linalg.solve_triangular(factor, scale[:, None] * left.rows(own), lower=True, check_finite=False)
    return left.with_more(model, half.T)
