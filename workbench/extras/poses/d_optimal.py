"""D-optimal choice of a few among many candidates: greedy, fast exchange, and a proven bound.

With C the inverse of the information Σ AᵢᵀAᵢ of what is chosen and V_j = B_j C B_jᵀ of every candidate's
block B_j, the determinant grows by det(I + V_j) when candidate j is added. With W_j = B_j C Aᵢᵀ it grows by

    det(I − Vᵢ) det(I + V_j + W_j (I − Vᵢ)⁻¹ W_jᵀ)

when candidate j replaces chosen block i, so a pass over all candidates costs one product with C Aᵢᵀ
and small determinants. C and all V_j follow each change by the same low-rank update; nothing is inverted but
matrices of one block's size.

The greedy choice starts from a ridge and inverts the information at each step, as updates from the ridge
would lose all digits. The exchange replaces every chosen candidate in turn by the best one until a round
changes nothing.

The bound: log det is concave in the candidates' weights w (Σ w = 1), so no choice of m candidates exceeds
log det(m M(w)) + max_j tr(M(w)⁻¹ B_jᵀB_j) − p, for any w; multiplicative steps make it tight.

Sources: Dykstra, Technometrics 13(3), 1971 (sequential augmentation); Fedorov, Theory of Optimal Experiments
(1972), §2.2 and §3; Harville, Matrix Algebra from a Statistician's Perspective (1997), §18.1, §18.2
(determinants); Silvey, Titterington & Torsney, Communications in Statistics A7(14), 1978 (multiplicative
steps).
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.errors import OptionError
from workbench.plate.exchange import Exchanged, descend

RIDGE = 1e-10
"""Prior information, as a share of the candidates' mean."""


def prior(blocks: Float[np.ndarray, "options r p"]) -> Float[np.ndarray, "p p"]:
    """Prior information, so that C exists before the first measurement."""
    count, _, size = blocks.shape
    return RIDGE * (blocks**2).sum() / (count * size) * np.eye(size)


def flattened(blocks: Float[np.ndarray, "options r p"]) -> Float[np.ndarray, "rows p"]:
    """All rows of all candidates, for one product with C."""
    return np.ascontiguousarray(blocks.reshape(-1, blocks.shape[2]))


def spreads(
    blocks: Float[np.ndarray, "options r p"],
    flat: Float[np.ndarray, "rows p"],
    inverse: Float[np.ndarray, "p p"],
) -> Float[np.ndarray, "options r r"]:
    """V_j = B_j C B_jᵀ of every candidate."""
    return (flat @ inverse).reshape(blocks.shape) @ blocks.transpose(0, 2, 1)


def with_block(
    blocks: Float[np.ndarray, "options r p"],
    flat: Float[np.ndarray, "rows p"],
    inverse: Float[np.ndarray, "p p"],
    spread: Float[np.ndarray, "options r r"],
    new: int,
) -> Float[np.ndarray, "p p"]:
    """C with one more block; every V_j is updated in place.

    C is symmetrised, since each update would double its asymmetry due to rounding.
    """
    count, rows, _ = blocks.shape
    reach = inverse @ blocks[new].T
    middle = -np.linalg.inv(np.eye(rows) + blocks[new] @ reach)
    spread += sandwich((flat @ reach).reshape(count, rows, rows), middle)
    found = inverse + reach @ middle @ reach.T
    return 0.5 * (found + found.T)


def sandwich(
    cross: Float[np.ndarray, "options r r"], middle: Float[np.ndarray, "r r"]
) -> Float[np.ndarray, "options r r"]:
    """W_j S W_jᵀ of every candidate."""
    return cross @ middle @ cross.transpose(0, 2, 1)


def growths(
    spread: Float[np.ndarray, "options r r"],
    cross: Float[np.ndarray, "options r r"],
    middle: Float[np.ndarray, "r r"],
) -> Float[np.ndarray, " options"]:
    """det(I + V_j + W_j S W_jᵀ) of every candidate."""
    return np.linalg.det(np.eye(len(middle)) + spread + sandwich(cross, middle))


def greedy_choice(
    blocks: Float[np.ndarray, "options r p"],
    number: int,
    *,
    clash: Bool[np.ndarray, "options options"] | None = None,
    follow: Bool[np.ndarray, "options options"] | None = None,
    first: int | None = None,
) -> Int[np.ndarray, " chosen"]:
    """Choose options one by one, as many as the limits allow.

    Args:
        blocks: Scaled, whitened Jacobian of each option.
        clash: Which options must not be chosen together; those alike must not if None.
        follow: Which options may follow each other; any if None.
        first: The first option; the most informative one if None.

    Returns:
        Numbers of the options in the order of choice; fewer than requested if none is left.
    """
    count, rows, _ = blocks.shape
    flat, information = flattened(blocks), prior(blocks)
    left, chosen = np.ones(count, bool), np.zeros(0, np.int64)
    while len(chosen) < number:
        after = left if follow is None or not len(chosen) else left & follow[chosen[-1]]
        if not after.any():
            break
        spread = spreads(blocks, flat, np.linalg.inv(information))
        gains = np.linalg.det(np.eye(rows) + spread)
        new = int(np.argmax(np.where(after, gains, -np.inf)))
        new = new if len(chosen) or first is None else first
        chosen = np.append(chosen, new)
        left &= ~clash[new] if clash is not None else np.arange(count) != new
        information = information + blocks[new].T @ blocks[new]
    return chosen


BETTER = 1e-10
"""An exchange must raise the determinant by more than this share."""
HASTE = 2.0
"""Power of the multiplicative steps of the bound; 1 is the classical step, 2 took half as many."""


def d_exchange(
    blocks: Float[np.ndarray, "options r p"], number: int, *, start: Int[np.ndarray, " number"] | None = None
) -> Exchanged:
    """Choose different candidates so that det(JᵀJ) is maximal.

    Args:
        blocks: Scaled, whitened Jacobian of each candidate.
        start: A choice to improve instead of the greedy one.

    Returns:
        The choice, with −O1 as its cost.

    Raises:
        OptionError: fewer candidates than are to be chosen.
    """
    count, rows, _ = blocks.shape
    if number > count:
        raise OptionError(f"{number} poses can't be chosen from {count} candidates; give more candidates")
    flat, ridge = flattened(blocks), prior(blocks)
    chosen = greedy_choice(blocks, number) if start is None else start.copy()
    inverse, spread = ridge, np.empty(0)

    def improve(slot: int, cost: float) -> float:
        nonlocal inverse, spread
        if not slot:  # anew in each round, as updates gather rounding
            inverse = np.linalg.inv(ridge + np.tensordot(blocks[chosen], blocks[chosen], ((0, 1), (0, 1))))
            spread = spreads(blocks, flat, inverse)
        old = chosen[slot]
        reach = inverse @ blocks[old].T
        cross = (flat @ reach).reshape(count, rows, rows)
        middle = np.linalg.inv(np.eye(rows) - spread[old])
        gains = growths(spread, cross, middle)
        gains[chosen] = -np.inf
        new = int(np.argmax(gains))
        if gains[new] * np.linalg.det(np.eye(rows) - spread[old]) <= 1.0 + BETTER:
            return cost
        chosen[slot] = new
        inverse = inverse + reach @ middle @ reach.T
        spread += sandwich(cross, middle)
        inverse = with_block(blocks, flat, inverse, spread, new)
        return _cost(blocks[chosen])

    history, outcome = descend(range(number), improve, _cost(blocks[chosen]))
    return Exchanged(chosen, history[-1], history, outcome)


def d_bound(
    blocks: Float[np.ndarray, "options r p"], number: int, *, share: float = 2e-3, steps: int = 2000
) -> float:
    """Smallest proven upper bound of O1 over all choices of so many candidates, repeats allowed.

    Args:
        blocks: Scaled, whitened Jacobian of each candidate.
        share: Stop when the bound is proven to lie within this share of the continuous optimum.
        steps: Maximum number of multiplicative steps.
    """
    count, rows, size = blocks.shape
    flat = flattened(blocks)
    weights = np.full(count, 1.0 / count)
    minimum = np.inf
    for _ in range(steps):
        information = flat.T @ (np.repeat(weights, rows)[:, None] * flat)
        inverse = np.linalg.inv(information)
        pull = ((flat @ inverse) * flat).reshape(count, -1).sum(1)
        gap = pull.max() - size
        minimum = min(minimum, np.linalg.slogdet(information)[1] + gap)
        if gap < 2.0 * size * share:
            break
        weights *= (pull / size) ** HASTE
        weights /= weights.sum()
    # O1 = det(JᵀJ)^(1/2p) / √m with JᵀJ = m M(w): the m cancels
    return float(np.exp(minimum / (2.0 * size)))


def _cost(chosen: Float[np.ndarray, "number r p"]) -> float:
    number, _, size = chosen.shape
    sign, logarithm = np.linalg.slogdet(np.tensordot(chosen, chosen, ((0, 1), (0, 1))))
    return -float(np.exp(logarithm / (2.0 * size)) / np.sqrt(number)) if sign > 0 else 0.0
