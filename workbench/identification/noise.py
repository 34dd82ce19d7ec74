"""Standard deviations of the measurements: as given, from repeated rows, or from what a fit leaves."""

from enum import Enum

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.identifier import Search
from workbench.identification.linear import Factor, factorise_pieces
from workbench.identification.problem import Noise, Problem

SAME_JOINTS = 1e-7
"""Rows whose joints agree within this [rad or m] are repeats."""
ENOUGH_REPEATS = 8
"""Degrees of freedom that repeats must have to be believed."""
SMALLEST = Noise(1e-8, 1e-8)
"""Below this a fit leaves only rounding, and the stated values are kept."""


class Given(Enum):
    """How much of the noise the rows bring themselves."""

    NONE = 0
    SOME = 1
    ALL = 2


def given_by_rows(problem: Problem) -> Given:
    """Whether every component that was measured has its own standard deviation."""
    if problem.data.sigma is None:
        return Given.NONE
    told = problem.with_noise(Noise(np.inf, np.inf)).inverse_sigma > 0.0
    live = problem.inverse_sigma > 0.0
    return Given.ALL if told[live].all() else Given.SOME if told.any() else Given.NONE


def stated(problem: Problem) -> Noise | None:
    """Root mean square of the standard deviations that rows bring themselves, per channel.

    NaN for rotations that nobody measured; None where a component brings none, or no positions were measured.
    """
    live, turned = problem.inverse_sigma > 0.0, problem.component_channels
    if given_by_rows(problem) is not Given.ALL or not (live & ~turned).any():
        return None
    straight, angles = (problem.inverse_sigma[live & mine] ** -2.0 for mine in (~turned, turned))
    rotation = np.sqrt(angles.mean()) if len(angles) else np.nan
    return Noise(float(np.sqrt(straight.mean())), float(rotation))


def from_repeats(data: Dataset) -> Noise | None:
    """Pooled scatter of positions and rotations measured several times at the same joints.

    Rows that are copies of each other to the last digit say nothing of the noise and are passed over.
    """
    if data.position is None or data.rotation is None:
        return None
    session = np.zeros(len(data)) if data.session is None else np.unique(data.session, return_inverse=True)[1]
    key = np.column_stack([session, np.round(data.q / SAME_JOINTS)])
    _, place = np.unique(key, axis=0, return_inverse=True)
    squares, freedom = np.zeros(2), 0
    for k in np.flatnonzero(np.bincount(place) > 1):
        rows = np.flatnonzero(place == k)
        _, once = np.unique(data.position[rows], axis=0, return_index=True)
        rows = rows[once]
        if len(rows) < 2:
            continue
        off = data.position[rows] - data.position[rows].mean(0)
        turn = se3.matrix_to_rotvec(data.rotation[rows] @ data.rotation[rows[0]].T)
        squares += [(off**2).sum() / 3.0, ((turn - turn.mean(0)) ** 2).sum() / 3.0]
        freedom += len(rows) - 1
    if freedom < ENOUGH_REPEATS or not np.isfinite(squares).all() or squares.min() == 0.0:
        return None
    return Noise(*np.sqrt(squares / freedom))


def from_fit(problem: Problem, search: Search) -> Noise | None:
    """Root mean square of what a search leaves, per channel; None where that is rounding."""
    return of_residual(problem, search.x)


def of_residual(problem: Problem, x: Float[np.ndarray, " p"], factor: Factor | None = None) -> Noise | None:
    """Root mean square of what is left at x, per channel; None where that is rounding or nothing is left.

    The share of the rows that went into the parameters is the trace of the hat matrix, so that what a prior
    already knew costs nothing.
    """
    free = problem.count - effective_parameters(problem, factor_at(problem, x) if factor is None else factor)
    if free < 1.0:
        return None
    components = problem.physical(problem.residual(x))
    live = problem.inverse_sigma > 0.0
    turned, straight = problem.component_channels & live, ~problem.component_channels & live
    share = max(free / problem.count, 0.02)
    position = np.sqrt((components[straight] ** 2).mean() / share) if straight.any() else np.nan
    rotation = np.sqrt((components[turned] ** 2).mean() / share) if turned.any() else problem.noise.rotation
    if position < SMALLEST.position or rotation < SMALLEST.rotation:
        return None
    return Noise(float(position), float(rotation))


def factor_at(problem: Problem, x: Float[np.ndarray, " p"]) -> Factor:
    """Factorisation of a problem's Jacobian, the prior's rows included, block by block."""
    return factorise_pieces((piece for _, piece in problem.pieces(x)), problem.units)


def effective_parameters(problem: Problem, factor: Factor) -> float:
    """Trace of the hat matrix of the measured rows: parameters that they, and not a prior, determine."""
    known = 0.0 if problem.prior is None else float(((problem.prior @ factor.root) ** 2).sum())
    return factor.rank - known
