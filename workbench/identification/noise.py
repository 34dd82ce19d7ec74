"""Standard deviations of the measurements: as given, from repeated rows, or from the residuals of a fit.

What a row states of itself is the instrument's repeatability, never the whole error. What is left beyond it,
mostly what the model lacks, is one more variance s² per channel, so that every component has

    sigma² = sigma_row² + s²

with the s that makes the residuals r of a fit most likely, its p parameters taken off the N components by the
factor N/(N−p) of r². Likely by Student's t rather than the normal law, so that a mis-seated row does not
make all others look uncertain; `consistent` makes both agree on normal residuals:

    min_s  Σ log v + (ν+1) log(1 + r² / (ν k² v)),    v = sigma_row² + s²

Rows that state nothing have sigma_row = 0, and s is then the root mean square of what is left.
"""

from enum import Enum

import numpy as np
from jaxtyping import Float
from scipy import optimize

from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.identification.columns import inner_products
from workbench.identification.joint_reading_noise import (
    FREEDOM,
    alike_readings,
    consistent,
    with_joint_readings,
)
from workbench.identification.problem import Noise, Problem
from workbench.identification.undetermined_combinations import Factor, factorise_pieces, factorise_products

SAME_JOINTS = 1e-7
"""Rows whose joints agree within this [rad or m] are repeats."""
ENOUGH_REPEATS = 8
"""Degrees of freedom that repeats must have to be believed."""
ENOUGH_SPARE = 10.0
"""Degrees of freedom below which noise of joint readings is not separated from that of the instrument."""
HEAVY = 1e9
"""Products of a Jacobian's columns from which on its factorisation takes long."""
MIN_PART = 1e-3
"""Part of what is left below which s counts as 0 where all rows state their own."""
ROUNDING_NOISE = Noise(1e-8, 1e-8)
"""Below this a fit leaves only rounding, and the stated values are kept."""


class StatedNoise(Enum):
    """How much of the noise the rows bring themselves."""

    NONE = 0
    SOME = 1
    ALL = 2


def given_by_rows(problem: Problem) -> StatedNoise:
    """Whether every component that was measured has its own standard deviation."""
    live = (problem.inverse_sigma > 0.0) & ~problem.tilted_components
    stated = problem.own_sigma > 0.0
    return StatedNoise.ALL if stated[live].all() else StatedNoise.SOME if stated.any() else StatedNoise.NONE


def stated(problem: Problem) -> Noise | None:
    """Root mean square of the standard deviations that rows bring themselves, per channel.

    NaN for rotations that nobody measured; None where a component brings none, or no positions were measured.
    """
    straight, turned, _ = channels(problem)
    if given_by_rows(problem) is not StatedNoise.ALL or not straight.any():
        return None
    straight, angles = problem.own_sigma[straight], problem.own_sigma[turned]
    rotation = np.sqrt((angles**2).mean()) if len(angles) else np.nan
    return Noise(float(np.sqrt((straight**2).mean())), float(rotation))


def from_repeats(data: Dataset) -> Noise | None:
    """Pooled scatter of positions and rotations measured several times at the same joints.

    Rows without a pose, or copied to the last digit from another, say nothing of noise and are left out.
    """
    if data.position is None or data.rotation is None:
        return None
    session = np.zeros(len(data)) if data.session is None else np.unique(data.session, return_inverse=True)[1]
    key = np.column_stack([session, np.round(data.q / SAME_JOINTS)])
    _, place = np.unique(key, axis=0, return_inverse=True)
    posed = np.isfinite(data.position).all(1) & np.isfinite(data.rotation).all((1, 2))
    squares, freedom = np.zeros(2), 0
    for k in np.flatnonzero(np.bincount(place) > 1):
        rows = np.flatnonzero((place == k) & posed)
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


def of_residual(problem: Problem, x: Float[np.ndarray, " p"], factor: Factor | None = None) -> Noise | None:
    """Root mean square of what is left at x, per channel; None where that is rounding or nothing is left.

    The share of the rows that went into the parameters is the trace of the hat matrix, so that what a prior
    already knew costs nothing.
    """
    share = _spare_share(problem, x, factor)
    if share is None:
        return None
    components = problem.physical(problem.residual(x))
    straight, turned, tilts = channels(problem)
    position = np.sqrt((components[straight] ** 2).mean() / share) if straight.any() else np.nan
    rotation = np.sqrt((components[turned] ** 2).mean() / share) if turned.any() else problem.noise.rotation
    tilt = np.sqrt((components[tilts] ** 2).mean() / share) if tilts.any() else problem.noise.tilt
    if (
        position < ROUNDING_NOISE.position
        or rotation < ROUNDING_NOISE.rotation
        or tilt < ROUNDING_NOISE.rotation
    ):
        return None
    return Noise(float(position), float(rotation), tilt=float(tilt))


def beyond_stated(problem: Problem, x: Float[np.ndarray, " p"], factor: Factor | None = None) -> Noise | None:
    """The s of every channel at x: what is left beyond what the rows state; None where that is unknown.

    That of rows which state nothing is the root mean square of what is left (`of_residual`).
    """
    if not (problem.own_sigma > 0.0).any():
        return of_residual(problem, x, factor)
    share = _spare_share(problem, x, factor)
    if share is None:
        return None
    square = problem.physical(problem.residual(x)) ** 2 / share
    found = [
        _most_likely(square[mine], problem.own_sigma[mine] ** 2) if mine.any() else old
        for mine, old in zip(channels(problem), (*problem.noise[:2], problem.noise.tilt), strict=True)
    ]
    return Noise(found[0], found[1], tilt=found[2])


def components(problem: Problem, x: Float[np.ndarray, " p"], factor: Factor | None = None) -> Noise | None:
    """The same with the noise of joint readings, if the rows show any beyond doubt (`joint_readings`)."""
    white, share = beyond_stated(problem, x, factor), _spare_share(problem, x, factor)
    if white is None or share is None or share * problem.count < ENOUGH_SPARE:
        return white
    residual = problem.physical(problem.residual(x)) / np.sqrt(share)
    return with_joint_readings(problem, residual, white, stated=bool((problem.own_sigma > 0.0).any()))


def _most_likely(square: Float[np.ndarray, " n"], own: Float[np.ndarray, " n"]) -> float:
    """The s for which squared residuals with variances own + s² are most likely; 0 if own explain them."""

    def cost(log_s: float) -> float:
        variance = own + np.exp(2.0 * log_s)
        tails = np.log1p(square / (FREEDOM * consistent(1) * variance))
        return float((np.log(variance) + (FREEDOM + 1.0) * tails).sum())

    largest = max(float(square.mean()), 1e-300)
    tried = 0.5 * np.log(largest) + np.linspace(np.log(MIN_PART), np.log(2.0), 40)
    costs = [cost(t) for t in tried]
    best = int(np.argmin(costs))
    if best == 0 and (own > 0.0).all():
        return 0.0
    low, high = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
    return float(np.exp(optimize.minimize_scalar(cost, bounds=(low, high), method="bounded").x))


def channels(problem: Problem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Components of position, of rotation, and of tilts beside them that were measured."""
    live, turned, tilts = problem.inverse_sigma > 0.0, problem.component_channels, problem.tilted_components
    return live & ~turned, live & turned & ~tilts, live & tilts


def _spare_share(problem: Problem, x: np.ndarray, factor: Factor | None) -> float | None:
    """Share of the components that did not go into parameters; None where none is left."""
    free = problem.count - effective_parameters(problem, factor_at(problem, x) if factor is None else factor)
    return None if free < 1.0 else max(free / problem.count, 0.02)


def factor_at(problem: Problem, x: Float[np.ndarray, " p"]) -> Factor:
    """Factorisation of a problem's Jacobian, the prior's rows included, block by block."""
    is_held = problem.deviation is not None  # else some constants are likely to do the same
    if is_held and problem.size * len(problem.names) ** 2 > HEAVY:
        found = factorise_products(inner_products(problem, x), problem.units)
        if found is not None:
            return found
    return factorise_pieces((piece for _, piece in problem.pieces(x)), problem.units)


def effective_parameters(problem: Problem, factor: Factor) -> float:
    """Trace of the hat matrix of the measured rows: parameters that they, and not a prior, determine."""
    known = 0.0 if problem.prior is None else float(((problem.prior @ factor.root) ** 2).sum())
    return factor.rank - known


def with_alike_readings(problem: Problem, x: Float[np.ndarray, " p"]) -> Noise:
    """The same where joints scatter for certain, each as much as the others."""
    share = _spare_share(problem, x, None) or 1.0
    return alike_readings(problem, problem.physical(problem.residual(x)) / np.sqrt(share))
