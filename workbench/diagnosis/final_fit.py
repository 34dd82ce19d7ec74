"""The result that a diagnosis saves: its model refitted on all rows except those that no arm explains.

All errors of held-out rows are from before: these rows are fitted only after everything has been decided.

Whether what is left is noise, its structure tells: residuals of neighbouring poses agree where the model
lacks something. The statistic is the mean product of every row's residual with its nearest neighbour's in
joint space; permuted rows show what chance adds.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from workbench.diagnosis.refit import refit
from workbench.diagnosis.rounds import Searched
from workbench.identification.algorithms.identifier import OnStep
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared
from workbench.identification.problem import Problem


def fitted_on_all(
    ready: Prepared, last: Searched, left_out: Bool[np.ndarray, " rows"], on_step: OnStep | None
) -> tuple[Fit, str | None]:
    """The last arm fitted once more on training and held-out rows, and a sentence about that.

    Held-out rows of another file stay untouched: then, and where the fit does not converge, it is the last
    arm itself.

    Args:
        ready: The rows.
        last: The last search, at the fit to be repeated.
        left_out: Held-out rows that are not fitted.
        on_step: Called after every step; True cancels.
    """
    stage = last.stage
    before = stage.fitted.fit
    if not len(ready.held_out_rows) or left_out.all():
        return before, None
    own = np.concatenate([before.problem.data.row, ready.held.row[~left_out]])
    rows = ready.data.take(np.isin(ready.data.row, own))
    found = refit(
        replace(stage.geometric, robot=ready.with_new_session_bases(stage.geometric.robot, ready.held)),
        last.grams,
        last.found.model,
        data=rows,
        begin=before.problem.named(before.x),
        on_step=on_step,
    ).fit
    if before.outcome.ok and not found.outcome.ok:
        return (
            before,
            f"a fit on all rows did not converge ({found.outcome}), so the arm is that of the others",
        )
    out = ", suspects left out" if left_out.any() else ""
    return found, (
        f"the arm itself was fitted once more on all {len(rows)} rows, held-out ones included{out}; "
        "errors of held-out rows are from before"
    )


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
