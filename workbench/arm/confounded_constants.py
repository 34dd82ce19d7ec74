"""Combinations of constants that measurements can't separate, as text."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.parameters import Parameter

NOTICEABLE = 0.05
"""Weights below this share of the largest are omitted from the text of an unidentifiable combination."""
EQUAL = 1e-6
"""Difference below which weights count as equal."""


@dataclass(frozen=True, eq=False)
class Combination:
    """Confounded parameters: a common change of them is unobservable in all rows.

    Args:
        names: The parameters, largest weight first.
        weights: Their shares [natural units], the largest 1.
        text: For people, such as `base yaw with joint1.theta`.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    text: str


def combinations(
    null_space: Float[np.ndarray, "p n"], parameters: tuple[Parameter, ...]
) -> tuple[Combination, ...]:
    """Text for a null space, with its basis reduced so that every vector involves few parameters.

    One parameter is unique to each combination: those that the null space moves most, the first of equal
    ones, whatever basis it is given in. Combinations are in the order of these.
    """
    left, unique = null_space, list[int]()
    for _ in range(null_space.shape[1]):
        size = np.linalg.norm(left, axis=1)
        unique.append(int(np.argmax(size > size.max() - EQUAL)))
        direction = left[unique[-1]] / size[unique[-1]]
        left = left - np.outer(left @ direction, direction)
    unique.sort()
    found = []
    for row in np.linalg.solve(null_space[unique].T, null_space.T):
        weights = row / np.abs(row).max()
        chosen = np.flatnonzero(np.abs(weights) > NOTICEABLE)
        chosen = chosen[np.argsort(-np.round(np.abs(weights[chosen]) / EQUAL), kind="stable")]
        ordered = sorted(chosen.tolist(), key=lambda i: parameters[i].is_geometry)
        parts = [parameters[i].text for i in ordered]
        text = " with ".join(parts) if len(parts) > 1 else f"{parts[0]} (unobservable)"
        if len(parts) > 3:
            text = f"{parts[0]} with a combination of {', '.join(parts[1:-1])} and {parts[-1]}"
        names = tuple(parameters[i].name for i in ordered)
        found.append(Combination(names, tuple(weights[ordered].tolist()), text))
    return tuple(found)
