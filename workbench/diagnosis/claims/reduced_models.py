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

from workbench.arm.effects import Candidate
from workbench.diagnosis.search.evidence import (
    JITTER,
    Model,
    Offer,
    Remainder,
    Term,
    curved,
    drop,
    factored,
    left_by,
    offer,
    own_columns,
    solver_of,
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
        self._inner, self._inverse = inner, scale[:, None] * inverse * scale
        self._found = self._inverse @ inner[:-1, -1]

    @classmethod
    def of(cls, grams: Grams, model: Model) -> "_Whole":
        """A model fitted to all rows."""
        used, precision = _used(grams, model)
        return cls(grams, among(grams.total, np.append(used, len(grams.total) - 1)), precision)

    def returned(
        self, places: Int[np.ndarray, " b"], across: Float[np.ndarray, "c n"]
    ) -> Float[np.ndarray, "c c"]:
        """Additional inner products of all columns that the reduced model leaves.

        Args:
            places: Indices of the removed columns.
            across: Inner products of all columns with those that the whole uses.
        """
        rest = np.delete(np.arange(len(self._found)), places)
        inner = among(self._inverse, places)
        factor, scale = factored(inner)
        taken = solver_of(inner)(self._inverse[np.ix_(places, rest)])
        half = (across[:, places] + across[:, rest] @ taken.T) @ (factor / scale[:, None])
        return half @ half.T

    def without(self, places: Int[np.ndarray, " b"]) -> tuple[np.ndarray, np.ndarray]:
        """Solution of the reduced model, zero for removed columns, and what it leaves of these columns and
        the residual."""
        rest, wide = np.delete(np.arange(len(self._found)), places), np.append(places, -1)
        across = self._inverse[np.ix_(rest, places)]
        taken = solver_of(among(self._inverse, places))(across.T).T
        found = np.zeros(len(self._found))
        found[rest] = self._found[rest] - taken @ self._found[places]
        explained = self._inner[np.ix_(wide, rest)] @ np.column_stack([-taken, found[rest]])
        return found, among(self._inner, wide) - 0.5 * (explained + explained.T)


def _used(grams: Grams, model: Model) -> tuple[Int[np.ndarray, " n"], Float[np.ndarray, "k k"]]:
    """Columns that a model uses, geometry first, and the prior precision of the others."""
    own, precision = own_columns(grams, model)
    return np.concatenate([np.arange(grams.geometry), own]), precision


def _places(grams: Grams, terms: Sequence[Term], used: Int[np.ndarray, " n"]) -> Int[np.ndarray, " b"]:
    """Indices of some terms among the used columns, masses that act through them included."""
    names = [n for t in terms for n in (*t.candidate.names, *grams.inertia.get(t.candidate.names, ()))]
    order = np.argsort(used)
    return order[np.searchsorted(used, grams.columns(names), sorter=order)]


def own_offers(grams: Grams, model: Model) -> list[Offer]:
    """Contribution of each of a model's terms to the others."""
    used, _ = _used(grams, model)
    whole, out = _Whole.of(grams, model), []
    for term in model:
        places = _places(grams, [term], used)
        requested, inner = np.append(used[places], len(grams.total) - 1), np.zeros_like(grams.total)
        inner[np.ix_(requested, requested)] = whole.without(places)[1]
        found = offer(Remainder.of(grams, drop(model, [term]), inner), term.candidate)
        out.append(Offer(term, -np.inf, 0.0) if found is None else found)
    return out


def validated_without(
    grams: Grams, model: Model, groups: Sequence[Model]
) -> Float[np.ndarray, "groups folds"]:
    """Sums of squares, as in `validated`, of a model without each of some groups of its terms."""
    used, precision = _used(grams, model)
    wide = np.append(used, len(grams.total) - 1)
    total, out = among(grams.total, wide), np.empty((len(groups), len(grams.folds)))
    places = [_places(grams, group, used) for group in groups]
    for k, fold in enumerate(grams.folds):
        mine = among(fold, wide)
        whole = _Whole(grams, total - mine, precision)
        for g, gone in enumerate(places):
            left = np.append(whole.without(gone)[0], -1.0)
            out[g, k] = left @ mine @ left
    return out


def left_of(grams: Grams, model: Model) -> Remainder:
    """As `left_by`, computed from the same model without its last term.

    Only inner products are cached: a `Remainder` refers to its `Grams` and would keep hundreds of MB in a
    cycle.
    """
    kept, key = grams.lefts, _key(model)
    if key in kept:
        return Remainder.of(grams, model, kept[key])
    if model and key[:-1] in kept:
        left = with_one_more(Remainder.of(grams, model[:-1], kept[key[:-1]]), model)
    else:
        left = left_by(grams, model)
    kept[key] = left.inner
    for old in list(kept)[:-CACHE_SIZE]:
        del kept[old]
    return left


def left_without(grams: Grams, model: Model, group: Model) -> Remainder:
    """Residual of a model without some of its terms."""
    left, key, (used, _) = left_of(grams, model), _key(model), _used(grams, model)
    if key not in grams.wholes:
        grams.wholes.clear()
        grams.wholes[key] = _Whole.of(grams, model)
    more = grams.wholes[key].returned(_places(grams, group, used), grams.total[:, used])
    return Remainder.of(grams, drop(model, group), left.inner + more)


def with_one_more(left: Remainder, model: Model) -> Remainder:
    """Residual of a model, given that of all but its last term."""
    own, precision = own_columns(left.grams, model[-1:])
    factor, scale = factored(among(left.inner, own) + precision + JITTER * np.eye(len(own)))
    half = linalg.solve_triangular(factor, scale[:, None] * left.inner[own], lower=True, check_finite=False)
    return Remainder.of(left.grams, model, left.inner - half.T @ half)


def _key(model: Model) -> tuple[tuple[Candidate, float], ...]:
    return tuple((t.candidate, t.precision) for t in model)
