"""What a fit leaves: is it noise, and of what?

*Structure*: residuals of neighbouring poses agree where the model lacks something. The statistic is the mean
product of every row's residual with its nearest neighbour's in joint space; permuted rows show what chance
brings.

*Noise of joint readings*: its residuals lie along the joints' columns and grow with the lever arm. The score
of its variance is compared with the spread that independent normal components would have.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import minimize_scalar
from scipy.spatial import cKDTree

from workbench.diagnosis.columns import joint_columns
from workbench.identification.fit import Fit
from workbench.identification.problem import Problem

PERMUTATIONS = 400
STRUCTURED = 0.005
"""Share of permutations that may agree as well as the rows do, for these to be called structured."""
SCORE = 4.0
"""Standard deviations of the score from which on noise of joint readings is recognised."""
EXPLAINS = 0.5
"""Share of what is left that it must explain."""


class JointNoise(NamedTuple):
    """Noise of joint readings.

    Args:
        sigma: Standard deviation [rad].
        share: Part of the residual's square that it explains.
    """

    sigma: float
    share: float


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


def joint_noise(fit: Fit) -> JointNoise | None:
    """Noise of joint readings, if what is left looks like it rather than like noise of the instrument."""
    problem = fit.problem
    if fit.spare < 10.0:
        return None
    columns = _joint_columns(fit)
    residual = _by_row(problem, fit.whitened)
    spread = np.einsum("rmj,rnj->rmn", columns, columns)
    share = np.trace(spread, axis1=1, axis2=2) / np.maximum((residual != 0.0).sum(1), 1)
    variance = fit.variance_factor
    pull = (
        np.einsum("rm,rmn,rn->r", residual, spread, residual) / variance
        - share * (residual**2).sum(1) / variance
    )
    centred = spread - share[:, None, None] * np.eye(spread.shape[1])
    deviation = np.sqrt(2.0 * (centred**2).sum())
    if pull.sum() < SCORE * deviation:
        return None
    return _likeliest(residual, spread, variance)


def _likeliest(residual: np.ndarray, spread: np.ndarray, variance: float) -> JointNoise | None:
    """Shares of joint noise and instrument noise that make the residual most likely."""
    live = residual != 0.0
    scale = np.trace(spread, axis1=1, axis2=2).sum() / live.sum()

    def cost(share: float) -> float:
        covariance = variance * ((1.0 - share) * np.eye(residual.shape[1]) + share / scale * spread)
        _, log_det = np.linalg.slogdet(covariance)
        solved = np.linalg.solve(covariance, residual[..., None])[..., 0]
        return float((residual * solved).sum() + log_det.sum())

    best = minimize_scalar(cost, bounds=(0.0, 0.999), method="bounded").x
    return JointNoise(float(np.sqrt(best * variance / scale)), float(best)) if best > EXPLAINS else None


def _joint_columns(fit: Fit) -> np.ndarray:
    """Whitened residual per radian of every joint, (rows, components, joints)."""
    problem = fit.problem
    out = np.zeros((len(problem.data), _width(problem), fit.calibrated.dof))
    for block, columns in joint_columns(problem, fit.x):
        shaped = columns.reshape(len(block.rows), -1, out.shape[2])
        out[block.rows, : shaped.shape[1]] = shaped
    return out


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
