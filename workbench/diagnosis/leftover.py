"""What a fit leaves: is it noise?

*Structure*: residuals of neighbouring poses agree where the model lacks something. The statistic is the mean
product of every row's residual with its nearest neighbour's in joint space; permuted rows show what chance
brings.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from workbench.identification.fit import Fit
from workbench.identification.problem import Problem

PERMUTATIONS = 400
STRUCTURED = 0.005
"""Share of permutations that may agree as well as the rows do, for these to be called structured."""


def structured(fit: Fit, rng: np.random.Generator) -> bool:
    """Whether neighbouring poses leave alike residuals."""
    problem = fit.problem
    if fit.spare < 10.0 or len(problem.data) < 20:
        return False
    rows = _by_row(problem, fit.whitened)
    q = problem.data.q / np.maximum(np.ptp(problem.data.q, axis=0), 1e-9)
    near = neighbours(q)
    agreement = float((rows * rows[near]).sum())
    chance = np.array([_agreement(rows, near, rng) for _ in range(PERMUTATIONS)])
    return bool((chance >= agreement).mean() < STRUCTURED)


def neighbours(q: Float[np.ndarray, "rows n"]) -> Int[np.ndarray, " rows"]:
    """The row nearest to every row, itself aside; where joints are repeated, one of the repeats."""
    _, nearest = cKDTree(q).query(q, k=2)
    return np.where(nearest[:, 0] == np.arange(len(q)), nearest[:, 1], nearest[:, 0])


def _agreement(rows: np.ndarray, near: np.ndarray, rng: np.random.Generator) -> float:
    mixed = rows[rng.permutation(len(rows))]
    return float((mixed * mixed[near]).sum())


def _width(problem: Problem) -> int:
    """Most residual components of a row."""
    return max(b.inverse_sigma.shape[1] for b in problem.blocks)


def _by_row(problem: Problem, components: np.ndarray) -> np.ndarray:
    """Components as a table, zeros where a row has fewer."""
    out = np.zeros((len(problem.data), _width(problem)))
    for block in problem.blocks:
        part = components[block.start : block.stop].reshape(len(block.rows), -1)
        out[block.rows, : part.shape[1]] = part
    return out
