"""Greedy choice of a few among many candidates: the start of an exchange (`plate.exchange`).

Adding candidate j with the block B_j to the information M multiplies its determinant by
det(I + B_j M⁻¹ B_jᵀ); the choice takes the largest, one by one. It begins with a ridge, so that M⁻¹ exists
before the first one.

Source: Dykstra, Technometrics 13(3), 1971 (sequential augmentation).
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Bool, Float

from workbench.plate.exchange import Exchange

RIDGE = 1e-10
"""Prior information, as a share of the candidates' mean."""


def prior(blocks: Float[np.ndarray, "options r p"]) -> Float[np.ndarray, "p p"]:
    """Prior information."""
    count, _, size = blocks.shape
    return RIDGE * (blocks**2).sum() / (count * size) * np.eye(size)


def greedy_choice(
    blocks: Float[np.ndarray, "options r p"],
    number: int,
    *,
    clash: Bool[np.ndarray, "options options"],
    first: Iterable[int] = (),
) -> list[int]:
    """Numbers of options, chosen one by one, as many as there are that don't clash.

    Args:
        blocks: Scaled, whitened Jacobian of each option.
        clash: Which options must not be chosen together; each clashes with itself.
        first: Those that are chosen before; then the most informative ones.
    """
    flat, before = blocks.reshape(-1, blocks.shape[2]), prior(blocks)

    def costs(chosen: list[int], slot: int) -> Float[np.ndarray, " options"]:
        known = blocks[chosen].reshape(-1, blocks.shape[2])
        spread = (flat @ np.linalg.inv(before + known.T @ known)).reshape(blocks.shape)
        gains = np.linalg.det(np.eye(blocks.shape[1]) + spread @ blocks.transpose(0, 2, 1))
        return np.where(clash[chosen].any(0), np.inf, -gains)

    return Exchange(costs, lambda chosen: 0.0).fill(number, first)
