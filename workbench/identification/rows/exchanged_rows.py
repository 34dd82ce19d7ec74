"""Pairs of outlying rows whose measurements look exchanged: each fits the pose of the other."""

from dataclasses import replace
from itertools import combinations, permutations

import numpy as np
from jaxtyping import Int

from workbench.base.advice import beside
from workbench.data.dataset import Dataset
from workbench.identification.fit import Fit
from workbench.identification.rows.outlying_rows import limits, row_sizes

MAX_SET_APART = 30
"""Number of outliers above which no exchange is looked for."""
SEEN = ("position", "rotation", "markers", "distance")
"""Fields that hold an instrument's readings."""


def exchanged_rows(fit: Fit, data: Dataset, outlying: Int[np.ndarray, " k"]) -> list[tuple[int, int]]:
    """Pairs of row numbers.

    Args:
        fit: Fit to the other rows.
        data: All rows.
        outlying: Outliers, indices into data.
    """
    if not 2 <= len(outlying) <= MAX_SET_APART:
        return []
    pairs = list(permutations(range(len(outlying)), 2))
    here, there = (data.take(outlying[[pair[k] for pair in pairs]]) for k in (0, 1))
    seen = {n: getattr(there, n) for n in SEEN if getattr(there, n) is not None}
    trial = fit.problem.again(data=replace(here, **seen), inertia=False)
    sizes = row_sizes(trial, trial.at(fit.problem.named(fit.x)), np.zeros(len(pairs), bool))
    own = row_sizes(fit.problem, fit.x, np.ones(len(fit.problem.data), bool))
    fits = dict(zip(pairs, np.all(sizes <= limits(own), axis=1).tolist(), strict=True))
    rows = data.row[outlying].tolist()
    return [
        (min(rows[i], rows[j]), max(rows[i], rows[j]))
        for i, j in combinations(range(len(outlying)), 2)
        if fits[i, j] and fits[j, i]
    ]


@beside("the note on exchanged rows", "")
def exchange_note(pairs: list[tuple[int, int]]) -> str:
    rows = "; ".join(f"rows {a} and {b} look exchanged" for a, b in pairs)
    return f"{rows}: with their measurements exchanged they fit; correct the file"
