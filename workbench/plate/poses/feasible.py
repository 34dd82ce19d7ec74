"""A first choice of poses that keeps all limits, or the sentence that says which of them conflict."""

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.errors import DataError
from workbench.plate.poses.greedy import greedy_choice
from workbench.plate.poses.limits import PoseLimits

STARTS = 30
"""Candidates from which a greedy choice is begun before the limits count as conflicting."""


def feasible_start(
    blocks: Float[np.ndarray, "options r p"],
    number: int,
    limits: PoseLimits,
    clash: Bool[np.ndarray, "options options"],
    follow: Bool[np.ndarray, "options options"] | None,
    *,
    rng: np.random.Generator,
) -> Int[np.ndarray, " number"]:
    """Candidates that keep the spread, in an order that keeps the travel.

    Args:
        blocks: Scaled, whitened Jacobian of each candidate.
        number: How many.
        limits: What is asked, for the words where it can't be had.
        clash: Which candidates must not be chosen together.
        follow: Which may follow each other; any if None.
        rng: Chooses where to begin.

    Raises:
        DataError: no such choice was found; names the limits that conflict.
    """
    found = _longest(blocks, number, clash, follow, rng)
    if len(found) == number:
        return found
    same = np.eye(len(blocks), dtype=bool)
    spread_alone = len(_longest(blocks, number, clash, None, rng))
    travel_alone = len(_longest(blocks, number, same, follow, rng))
    spread = f"a spread of {1e3 * limits.spread:g} mm"
    travel = f"a travel of at most {np.rad2deg(limits.travel or np.pi):.3g}° from pose to pose"
    where = "the region" if limits.region is not None else "the reach of the arm"
    if spread_alone < number:
        raise DataError(
            f"{number} poses with {spread} and {where} conflict: at most {spread_alone} were found to fit; "
            "ask for fewer poses or less spread"
        )
    if travel_alone < number:
        raise DataError(
            f"{number} different poses and {travel} conflict: at most {travel_alone} were found; allow more "
            "travel or give more candidates"
        )
    raise DataError(
        f"{spread} and {travel} conflict: at most {len(found)} of {number} poses were found that keep both; "
        "relax one of them"
    )


def _longest(blocks, number, clash, follow, rng) -> np.ndarray:
    """The longest of several greedy choices; the first that is long enough."""
    firsts = [None, *rng.permutation(len(blocks))[:STARTS].tolist()]
    best = np.zeros(0, np.int64)
    for first in firsts:
        found = greedy_choice(blocks, number, clash=clash, follow=follow, first=first)
        if len(found) > len(best):
            best = found
        if len(best) == number:
            break
    return best
