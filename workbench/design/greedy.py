"""Greedy choice: one measurement after the other, each the one that tells most beside those before it.

A measurement B adds log det(I + B C Bᵀ) to log det of the information, with C the inverse of what is known
so far (a ridge at first). The choice may be limited: options that clash with a chosen one are out, and where
options must follow each other only those that may follow the last one are open.

Source: Dykstra, Technometrics 13(3), 1971 (sequential augmentation).
"""

import numpy as np
from jaxtyping import Bool, Float, Int

RIDGE = 1e-10
"""Information known beforehand, as a share of the candidates' mean, so that C exists from the first pose."""


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
    count, rows, size = blocks.shape
    inverse = np.eye(size) / (RIDGE * (blocks**2).sum() / (count * size))
    left, chosen = np.ones(count, bool), np.zeros(0, np.int64)
    while len(chosen) < number:
        after = left if follow is None or not len(chosen) else left & follow[chosen[-1]]
        options = np.flatnonzero(after) if len(chosen) or first is None else np.array([first])
        if not len(options):
            break
        spread = blocks[options] @ inverse @ blocks[options].transpose(0, 2, 1)
        new = options[np.argmax(np.linalg.slogdet(np.eye(rows) + spread)[1])]
        chosen = np.append(chosen, new)
        left &= ~clash[new] if clash is not None else np.arange(count) != new
        reach = inverse @ blocks[new].T
        inverse = inverse - reach @ np.linalg.solve(np.eye(rows) + blocks[new] @ reach, reach.T)
    return chosen
