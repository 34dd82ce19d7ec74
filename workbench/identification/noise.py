"""Standard deviations of the measurements: as given, from repeated rows, or from the residuals of a fit.

A row's own sigma is the instrument's repeatability, never the whole error. The residual beyond it, mostly
model error, is one more variance s² per channel, so that every component has

    sigma² = sigma_row² + s²

where s maximises the likelihood of the residuals r of a fit, with r² scaled by N/(N−p) for p parameters and N
components. The likelihood is Student's t rather than normal, so that a mis-seated row does not make all
others look uncertain; `consistent` makes both agree on normal residuals:

    min_s  Σ log v + (ν+1) log(1 + r² / (ν k² v)),    v = sigma_row² + s²

Rows without a sigma have sigma_row = 0, and s is then the root mean square of the residuals.
"""

from functools import lru_cache
from itertools import chain

import numpy as np
from jaxtyping import Float

from workbench.base import se3
from workbench.data.dataset import Dataset
from workbench.data.postures import equal_rows
from workbench.identification.column_products import inner_products
from workbench.identification.problem import Noise, Problem
from workbench.identification.undetermined_combinations import Factor, factorise, factorise_products

SAME_JOINTS = 1e-7
"""Rows whose joints agree within this [rad or m] are repeats."""
MIN_REPEAT_FREEDOM = 8
"""Minimum degrees of freedom of repeats."""
STUDENT_FREEDOM = 5.0
"""Degrees of freedom ν of Student's t for residuals."""
MAX_QUICK_PRODUCTS = 1e9
"""Number of products of Jacobian columns above which a factorisation takes long."""
ROOT_TOLERANCE = 1e-12  # of two steps that are the same
PARTS = np.linspace(np.log(1e-3), np.log(2.0), 20)
"""Logarithms of the shares of the residual that are tried for s; at the first one s counts as 0 if all rows
state their own sigma."""
MIN_FREE, FEW_FREE = 0.02, 10.0
"""Least free share of the components; components per unknown up to which that of channels differs much."""
ROUNDING_NOISE = Noise(1e-8, 1e-8)
"""Residuals below this [m or rad] are rounding; the stated values are kept."""


def share_stated(problem: Problem) -> float:
    """Share of measured components with their own standard deviation, without tilts beside others."""
    straight, turned, _ = problem.channels
    return float((problem.own_sigma > 0.0)[straight | turned].mean())


def stated(problem: Problem) -> Noise | None:
    """Root mean square of the standard deviations that rows state, per channel.

    NaN for rotations that were not measured; None if a component has none, or no positions were measured.
    """
    if share_stated(problem) < 1.0 or not problem.channels[0].any():
        return None
    return problem.root_mean_square(problem.own_sigma)


def from_repeats(data: Dataset) -> Noise | None:
    """Pooled scatter of positions and rotations measured several times at the same joint positions.

    Rows without a pose, or copied to the last digit from another, carry no information on noise and are
    ignored.
    """
    joints = np.round(data.q / SAME_JOINTS)
    if data.position is None or data.rotation is None or len(np.unique(joints[:, 0])) == len(data):
        return None
    session = np.zeros(len(data)) if data.session is None else np.unique(data.session, return_inverse=True)[1]
    posed = np.isfinite(data.position).all(1) & np.isfinite(data.rotation).all((1, 2))
    key = np.column_stack([session, joints, data.position])
    once = np.flatnonzero(posed)[equal_rows(key[posed])[1]]
    place, first = equal_rows(key[once, :-3])
    turn = data.rotation[once] @ np.swapaxes(data.rotation[once[first[place]]], 1, 2)
    seen = np.hstack([data.position[once], se3.matrix_to_rotvec(turn)])
    means = np.array([np.bincount(place, column) for column in seen.T]).T / np.bincount(place)[:, None]
    squares = ((seen - means[place]) ** 2).reshape(-1, 2, 3).sum((0, 2)) / 3.0
    freedom = len(once) - len(first)
    if freedom < MIN_REPEAT_FREEDOM or not np.isfinite(squares).all() or squares.min() == 0.0:
        return None
    return Noise(*np.sqrt(squares / freedom))


def beyond_stated(
    problem: Problem, x: Float[np.ndarray, " p"], factor: Factor | None = None, *, in_all: bool = False
) -> Noise | None:
    """s of every channel at x: the residual beyond what the rows state, the old one for channels without any;
    None if it is rounding, or unknown.

    Degrees of freedom follow from the trace of the hat matrix, so that prior knowledge costs none; for few
    rows from that of each channel, as a fit through one of two leaves nothing to tell its noise by.

    Args:
        in_all: Whether it is the root mean square of the residual instead, as for rows that state nothing.
    """
    own = problem.own_sigma**2 * (not in_all)
    if (share := spare_share(problem, x, factor)) is None:
        return None
    square, is_stated = problem.physical(problem.residual(x)) ** 2, bool((own > 0.0).any())
    shares = _shares_of_channels(problem, x, factor, share)
    sizes = [problem.noise.position if is_stated else np.nan, problem.noise.rotation, problem.noise.tilt]
    for k, m in enumerate(problem.channels):
        if m.any():
            mine = square[m] / shares[k]
            sizes[k] = _most_likely(mine, own[m]) if is_stated else float(np.sqrt(mine.mean()))
    is_rounding = sizes[0] < ROUNDING_NOISE.position or not min(sizes[1:]) >= ROUNDING_NOISE.rotation
    return None if is_rounding and not is_stated else Noise(sizes[0], sizes[1], tilt=sizes[2])


@lru_cache(maxsize=64)
def consistent(components: int) -> float:
    """k² for which normal residuals of variance 1 have that variance under Student's law too."""
    from scipy import special

    square = 2.0 * special.gammaincinv(components / 2.0, (np.arange(2000) + 0.5) / 2000)  # χ², components
    found, last = 1.0, 0.0
    while components and abs(found - last) > ROOT_TOLERANCE:
        weight = (STUDENT_FREEDOM + components) / (STUDENT_FREEDOM * found + square)
        found, last = found * float((weight * square).mean()) / components, found
    return found


def _most_likely(square: Float[np.ndarray, " n"], own: Float[np.ndarray, " n"]) -> float:
    """The most likely s for variances own + s²; 0 if own suffices."""
    scaled = square / (STUDENT_FREEDOM * consistent(1))
    heavy = (STUDENT_FREEDOM + 1.0) * scaled

    def slope(added):
        variance = own + added
        return (added / variance * (1.0 - heavy / (variance + scaled))).sum(-1)

    def cost(log_s: float) -> float:
        variance = own + np.exp(2.0 * log_s)
        return float((np.log(variance) + (STUDENT_FREEDOM + 1.0) * np.log1p(scaled / variance)).sum())

    tried = 0.5 * np.log(max(float(square.mean()), 1e-300)) + PARTS
    slopes = slope(np.exp(2.0 * tried)[:, None])
    rising = slopes >= 0.0
    turns = np.flatnonzero(~rising[:-1] & rising[1:])
    found = [tried[0]] * bool(rising[0]) + [tried[-1]] * bool(not rising[-1])
    for k in turns:  # the Illinois method, BIT 11, 1971; scipy's import outlasts a fit
        (other, x), (opposite, value) = tried[k : k + 2], slopes[k : k + 2]
        while value and abs(x - other) > ROOT_TOLERANCE:
            new = x - value * (x - other) / (value - opposite)
            at_new = slope(np.exp(2.0 * new))
            other, opposite = (x, value) if at_new * value < 0.0 else (other, 0.5 * opposite)
            x, value = new, at_new
        found.append(x)
    best = min(found, key=cost) if len(found) > 1 else found[0]
    return 0.0 if best == tried[0] and (own > 0.0).all() else float(np.exp(best))


def spare_share(problem: Problem, x: np.ndarray, factor: Factor | None = None) -> float | None:
    """Degrees of freedom as a share of the components; None if none is left."""
    free = degrees_of_freedom(problem, factor_at(problem, x) if factor is None else factor)
    return None if free < 1.0 else max(free / problem.count, MIN_FREE)


def is_of_few(problem: Problem) -> bool:
    """Whether so few components were measured that the shares of their channels differ much."""
    return problem.count <= FEW_FREE * len(problem.names)


def _shares_of_channels(
    problem: Problem, x: np.ndarray, factor: Factor | None, whole: float
) -> tuple[float, ...]:
    """Share of each channel's components that is free; of one channel, or many rows, as of all."""
    channels = problem.channels
    if sum(bool(m.any()) for m in channels) < 2 or not is_of_few(problem):
        return (whole,) * len(channels)
    root = (factor_at(problem, x) if factor is None else factor).root
    used = np.concatenate([((p.jacobian @ root) ** 2).sum(1) for _, p in problem.pieces(x)])
    return tuple(max(1.0 - float(used[m].mean()), MIN_FREE) if m.any() else whole for m in channels)


def factor_at(problem: Problem, x: Float[np.ndarray, " p"]) -> Factor:
    """Factorisation of a problem's Jacobian, rows of the prior included, block by block."""
    is_held = problem.deviation is not None  # else some constants are likely to do the same
    if is_held and problem.size * len(problem.names) ** 2 > MAX_QUICK_PRODUCTS:
        found = factorise_products(inner_products(problem, x), problem.units)
        if found is not None:
            return found
    return factorise(chain((p for _, p in problem.pieces(x)), [problem.prior_at(x)]), problem.units)


def degrees_of_freedom(problem: Problem, factor: Factor) -> float:
    """Measured numbers less the trace of their hat matrix, which is how many parameters they determine."""
    return problem.count - (factor.rank - float(((problem.prior @ factor.root) ** 2).sum()))
