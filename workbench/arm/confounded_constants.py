"""Combinations of constants that measurements can't separate, as text."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.parameters import Parameter

NOTICEABLE = 0.05
"""Weights below this share of the largest are omitted from the text of an unidentifiable combination."""


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

    Gauss–Jordan elimination with the largest pivots leaves one parameter unique to each combination; those
    that must change with it are named after it.
    """
    rows = null_space.T.copy()
    used: list[int] = []
    for k in range(len(rows)):
        free = np.abs(rows[k:])
        free[:, used] = 0.0
        row, column = divmod(int(np.argmax(free)), rows.shape[1])
        rows[[k, k + row]] = rows[[k + row, k]]
        rows[k] /= rows[k, column]
        others = np.arange(len(rows)) != k
        rows[others] -= np.outer(rows[others, column], rows[k])
        used.append(column)
    found = []
    for row in rows:
        weights = row / np.abs(row).max()
        chosen = np.flatnonzero(np.abs(weights) > NOTICEABLE)
        chosen = chosen[np.argsort(-np.abs(weights[chosen]), kind="stable")]
        found.append(_combination([parameters[i] for i in chosen], weights[chosen]))
    return tuple(found)


def _combination(parameters: list[Parameter], weights: np.ndarray) -> Combination:
    ordered = sorted(zip(parameters, weights, strict=True), key=lambda pair: pair[0].is_geometry)
    parts = [p.text for p, _ in ordered]
    text = " with ".join(parts) if len(parts) > 1 else f"{parts[0]} (unobservable)"
    if len(parts) > 3:
        text = f"{parts[0]} with a combination of {', '.join(parts[1:-1])} and {parts[-1]}"
    return Combination(tuple(p.name for p, _ in ordered), tuple(float(w) for _, w in ordered), text)
