"""Greedy choice of a few among many candidates: the start of an exchange (`plate.exchange`).

Adding candidate j with the block B_j to the information M multiplies its determinant by
det(I + B_j M⁻¹ B_jᵀ); the choice takes the largest, one by one. It begins with a ridge, so that M⁻¹ exists
before the first one.

Source: Dykstra, Technometrics 13(3), 1971 (sequential augmentation).
"""

import numpy as np
from jaxtyping import Bool, Float, Int

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
    first: int | None = None,
) -> Int[np.ndarray, " chosen"]:
    """Choose options one by one, as many as there are that don't clash.

    Args:
        blocks: Scaled, whitened Jacobian of each option.
        clash: Which options must not be chosen together; each clashes with itself.
        first: The first option; the most informative one if None.

    Returns:
        Numbers of the options in the order of choice; fewer than requested if none is left.
    """
    information, flat = prior(blocks), blocks.reshape(-1, blocks.shape[2])
    left, chosen = np.ones(len(blocks), bool), np.zeros(0, np.int64)
    while len(chosen) < number and left.any():
        spread = (flat @ np.linalg.inv(information)).reshape(blocks.shape) @ blocks.transpose(0, 2, 1)
        gains = np.linalg.det(np.eye(blocks.shape[1]) + spread)
        new = int(np.argmax(np.where(left, gains, -np.inf))) if len(chosen) or first is None else first
        chosen = np.append(chosen, new)
        left &= ~clash[new]
        information = information + blocks[new].T @ blocks[new]
    return chosen
