"""Greedy choice: one measurement after the other, each the one that tells most beside those before it.

A measurement B adds log det(I + B C Bᵀ) to log det of the information, with C the inverse of what is known
so far (a ridge at first). The choice may be limited: options that clash with a chosen one are out, and where
options must follow each other only those that may follow the last one are open.

Source: Dykstra, Technometrics 13(3), 1971 (sequential augmentation).
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.plate.poses import low_rank


def greedy_choice(
    blocks: Float[np.ndarray, "options r p"],
    number: int,
    *,
    clash: Bool[np.ndarray, "options options"] | None = None,
    follow: Bool[np.ndarray, "options options"] | None = None,
    first: int | None = None,
) -> Int[np.ndarray, " chosen"]:
    """Choose options one by one, as many as the limits leave open.

    Args:
        blocks: Scaled, whitened Jacobian of each option.
        number: How many to choose.
        clash: Which options must not be chosen together; those alike must not if None.
        follow: Which options may follow each other; any if None.
        first: The option to begin with; the one that tells most if None.

    Returns:
        Numbers of the options in the order of choice; fewer than asked where nothing is left.
    """
    count, rows, _ = blocks.shape
    flat, inverse = low_rank.flattened(blocks), np.linalg.inv(low_rank.prior(blocks))
    spread = low_rank.spreads(blocks, flat, inverse)
    nothing = np.zeros_like(spread)
    left, chosen = np.ones(count, bool), np.zeros(0, np.int64)
    while len(chosen) < number:
        after = left if follow is None or not len(chosen) else left & follow[chosen[-1]]
        if not after.any():
            break
        gains = low_rank.growths(spread, nothing, np.eye(rows))
        new = int(np.argmax(np.where(after, gains, -np.inf)))
        new = new if len(chosen) or first is None else first
        chosen = np.append(chosen, new)
        left &= ~clash[new] if clash is not None else np.arange(count) != new
        inverse = low_rank.take_in(blocks, flat, inverse, spread, new)
    return chosen
