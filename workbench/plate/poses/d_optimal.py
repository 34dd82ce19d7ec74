"""Fast exchange for O1: the D-optimal choice of a few among many candidate poses.

With C = (Σ AᵢᵀAᵢ)⁻¹ over the chosen blocks, V_j = B_j C B_jᵀ of every candidate and W_j = B_j C Aᵢᵀ, the
determinant after chosen block i has made way for candidate j grows by

    det(I − Vᵢ) det(I + V_j + W_j (I − Vᵢ)⁻¹ W_jᵀ)

so a pass over all candidates costs one product with C Aᵢᵀ and small determinants. C and all V_j follow
each exchange by the same update (`low_rank`). First the poses are chosen greedily (or a start is given), then
every chosen pose in turn is exchanged for the best candidate until a round changes nothing.

The bound: log det is concave in the candidates' weights w (Σ w = 1), so no choice of m candidates exceeds
log det(m M(w)) + max_j tr(M(w)⁻¹ B_jᵀB_j) − p, for any w; multiplicative steps make it tight.

Sources: Fedorov, Theory of Optimal Experiments (1972), §2.2 and §3; Harville, Matrix Algebra from a
Statistician's Perspective (1997), §18.1 (determinants); Silvey, Titterington & Torsney, Communications in
Statistics A7(14), 1978 (multiplicative steps).
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

from workbench.base.errors import OptionError
from workbench.base.types import Outcome
from workbench.plate.poses import low_rank
from workbench.plate.poses.exchange import ROUNDS, Exchanged
from workbench.plate.poses.greedy import greedy_choice

BETTER = 1e-10
"""An exchange must raise the determinant by more than this share."""
HASTE = 2.0
"""Power of the multiplicative steps of the bound; 1 is the classical step, 2 took half as many."""


def d_exchange(
    blocks: Float[np.ndarray, "options r p"],
    number: int,
    *,
    start: Int[np.ndarray, " number"] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Exchanged:
    """Choose different candidates so that det(JᵀJ) is greatest.

    Args:
        blocks: Scaled, whitened Jacobian of each candidate.
        number: How many to choose.
        start: A choice to improve instead of the greedy one.
        cancel: Asked between exchanges whether to stop with the present choice.

    Returns:
        The choice, with −O1 as its cost.

    Raises:
        OptionError: fewer candidates than are to be chosen.
    """
    count, rows, _ = blocks.shape
    if number > count:
        raise OptionError(f"{number} poses can't be chosen from {count} candidates; give more candidates")
    flat, ridge = low_rank.flattened(blocks), low_rank.prior(blocks)
    chosen = greedy_choice(blocks, number) if start is None else start.copy()
    history = [_cost(blocks[chosen])]
    outcome = Outcome.ITERATION_LIMIT
    for _ in range(ROUNDS):
        inverse = np.linalg.inv(ridge + np.tensordot(blocks[chosen], blocks[chosen], ((0, 1), (0, 1))))
        spread = low_rank.spreads(blocks, flat, inverse)
        changed = False
        for slot in range(number):
            if cancel is not None and cancel():
                return Exchanged(chosen, _cost(blocks[chosen]), tuple(history), Outcome.CANCELLED)
            old = chosen[slot]
            reach = inverse @ blocks[old].T
            cross = (flat @ reach).reshape(count, rows, rows)
            middle = np.linalg.inv(np.eye(rows) - spread[old])
            gains = low_rank.growths(spread, cross, middle)
            gains[chosen] = -np.inf
            new = int(np.argmax(gains))
            if gains[new] * np.linalg.det(np.eye(rows) - spread[old]) > 1.0 + BETTER:
                chosen[slot] = new
                inverse = inverse + reach @ middle @ reach.T
                low_rank.add(spread, cross, middle)
                inverse = low_rank.take_in(blocks, flat, inverse, spread, new)
                changed = True
        history.append(_cost(blocks[chosen]))
        if not changed:
            outcome = Outcome.CONVERGED
            break
    return Exchanged(chosen, history[-1], tuple(history), outcome)


def d_bound(
    blocks: Float[np.ndarray, "options r p"], number: int, *, share: float = 2e-3, steps: int = 2000
) -> float:
    """Least proven upper bound of O1 over all choices of so many candidates, repeats allowed.

    Args:
        blocks: Scaled, whitened Jacobian of each candidate.
        number: How many are to be chosen.
        share: Stop when the bound is proven to lie within this share of the continuous optimum.
        steps: Greatest number of multiplicative steps.
    """
    count, rows, size = blocks.shape
    flat = low_rank.flattened(blocks)
    weights = np.full(count, 1.0 / count)
    least = np.inf
    for _ in range(steps):
        information = flat.T @ (np.repeat(weights, rows)[:, None] * flat)
        inverse = np.linalg.inv(information)
        pull = ((flat @ inverse) * flat).reshape(count, -1).sum(1)
        gap = pull.max() - size
        least = min(least, np.linalg.slogdet(information)[1] + gap)
        if gap < 2.0 * size * share:
            break
        weights *= (pull / size) ** HASTE
        weights /= weights.sum()
    # O1 = det(JᵀJ)^(1/2p) / √m with JᵀJ = m M(w): the m cancels
    return float(np.exp(least / (2.0 * size)))


def _cost(chosen: Float[np.ndarray, "number r p"]) -> float:
    number, _, size = chosen.shape
    sign, logarithm = np.linalg.slogdet(np.tensordot(chosen, chosen, ((0, 1), (0, 1))))
    return -float(np.exp(logarithm / (2.0 * size)) / np.sqrt(number)) if sign > 0 else 0.0
