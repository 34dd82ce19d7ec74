"""Confidence intervals of errors on fresh rows: bootstrap for means, exact bounds for all other poses.

Rows are drawn with replacement, all visits of a pose together, and whole groups where the data have them
(rows of one grid point resemble each other); the interval of a mean or rms is that between quantiles of the
draws. What holds for poses that were not measured follows from the binomial law without any assumption on the
errors' distribution. Of n independent poses, each with the worst of its visits, the k-th smallest error is
kept by a share p of all poses with confidence P(Binomial(n, p) < k), and with m of n poses within a limit the
share of all poses within is at least the Clopper–Pearson bound. 59 poses are the fewest whose largest error
bounds 95 % of all poses with 95 % confidence.

Sources: Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13; Wilks, Ann. Math. Stat. 12, 1941.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy import special

CONFIDENCE = 0.95
BOUNDED_SHARE = 0.95
"""Part of all poses that a bound holds for."""
DRAWS, PIECE = 2000, 100


class Interval(NamedTuple):
    """Where a number lies with 95 % confidence."""

    low: float
    high: float


class Bounds(NamedTuple):
    """What rows show of one error [any unit].

    Args:
        mean: Interval of the mean.
        rms: Interval of the root mean square.
        maximum: Bound that 95 % of all poses keep, with 95 % confidence; NaN with fewer than 59 poses.
    """

    mean: Interval
    rms: Interval
    maximum: float

    @classmethod
    def of(
        cls,
        errors: Float[np.ndarray, " rows"],
        pose: Int[np.ndarray, " rows"],
        group: np.ndarray,
        rng: np.random.Generator,
    ) -> "Bounds":
        """Intervals of one error a row, at least one.

        Args:
            pose: Which pose each row visits.
            group: Label of what is drawn together: that pose again, or the data's own groups.
        """
        label = np.unique(group, return_inverse=True)[1]
        sums = np.stack([np.bincount(label, w) for w in (np.ones(len(errors)), errors, errors**2)], 1)
        count, even = len(sums), np.full(len(sums), 1.0 / len(sums))
        drawn = np.concatenate(
            [rng.multinomial(count, even, PIECE).astype(float) @ sums for _ in range(DRAWS // PIECE)]
        )
        means, squares = drawn[:, 1] / drawn[:, 0], drawn[:, 2] / drawn[:, 0]
        tails = 0.5 * np.array([1.0 - CONFIDENCE, 1.0 + CONFIDENCE])
        mean, rms = np.quantile(means, tails), np.sqrt(np.quantile(squares, tails))
        return cls(Interval(*mean.tolist()), Interval(*rms.tolist()), tolerance_bound(worst_of(errors, pose)))


def worst_of(
    errors: Float[np.ndarray, " rows"], pose: Int[np.ndarray, " rows"]
) -> Float[np.ndarray, " poses"]:
    """Maximum error of every pose's visits."""
    label = np.unique(pose, return_inverse=True)[1]
    worst = np.zeros(label.max() + 1)
    np.maximum.at(worst, label, errors)
    return worst


def tolerance_bound(errors: Float[np.ndarray, " poses"]) -> float:
    """An error that 95 % of all poses keep, with 95 % confidence; NaN where the poses are too few."""
    n = len(errors)
    place = np.arange(1, n + 1)
    confident = special.betainc(place, n - place + 1, BOUNDED_SHARE) <= 1.0 - CONFIDENCE
    return float(np.sort(errors)[np.argmax(confident)]) if confident.any() else float("nan")


def minimum_share(within: int, poses: int) -> float:
    """Share of all poses that keep a limit, at least, with 95 % confidence, if so many of some poses do."""
    return float(special.betaincinv(within, poses - within + 1, 1.0 - CONFIDENCE)) if within else 0.0
