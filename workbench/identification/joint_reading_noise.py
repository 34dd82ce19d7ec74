"""Noise of joint readings: one variance per joint beside those of the instrument.

A reading that is off by e moves the residual by −B e, with B the residual's derivative by the joints. Rows
are independent of each other, the components of a row are not:

    C = diag(sigma_row² + s²) + B diag(sigma_q²) Bᵀ

s per channel and sigma_q per joint maximise the likelihood of the residuals r of a fit, with r² scaled by
N/(N−p) for its p parameters. Positions have one s, or one per axis of the measuring frame, as a camera sees
depth worse. The likelihood is Student's t of a row's d² = rᵀ C⁻¹ r, so that a mis-seated row does not affect
the joints' noise:

    min  ½ Σ log|C| + (ν+m) log(1 + d² / (ν k²))

Readings count as exact unless the Bayesian information criterion prefers noise by at least `MIN_GAIN`. Axes
and joints of one kind share a variance or have their own, whichever that criterion prefers. An effect that
the model lacks lies along the joints' columns too. Until it is found it counts as noise of the readings,
unless the errors of a joint are a smooth function of its angle: then its readings count as exact, and the
effect is looked for first. So do those of joints whose errors follow that angle once it is so.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.chain import Chain
from workbench.arm.effects.axes import turns
from workbench.base.errors import ShapeError
from workbench.base.wording import joint_list
from workbench.data.observation import Channel
from workbench.identification.noise import STUDENT_FREEDOM, beyond_stated, consistent, spare_share
from workbench.identification.problem import Noise, Problem
from workbench.identification.undetermined_combinations import Factor

MIN_SPARE_FREEDOM = 10.0
"""Degrees of freedom below which noise of joint readings is not separated from that of the instrument."""
MIN_GAIN = 3.0
"""Gain in log likelihood that noise of joint readings must have beyond the information criterion."""
TOGETHER, APART = ([0, 1, 2], [3]), ([0], [1], [2], [3])
"""Channels, three axes of positions and rotations, that share a variance."""
CHANNELS = 4
MAX_NOISE_ROWS = 2000
"""Maximum number of rows for the variances, evenly spread; more would hardly change them."""
MIN_VARIANCE_SHARE = 1e-4
"""Minimum variance of a channel relative to the residual's, where rows state none …"""
MIN_READING_VARIANCE = 1e-3
"""… and that of a joint below which its readings count as exact."""
OUTSTANDING_RATIO = 3.0
"""A joint stands out if its scatter exceeds that of most others by this factor."""
MAX_READING_ERROR = 0.01
"""Residuals that joint errors below this [rad or m] would explain count as zero."""
SMOOTH_DEVIATIONS = 3.0
"""Standard deviations by which errors at neighbouring joint angles must agree to count as an effect, not
noise."""
DIGITS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
"""Last digits of joint angles that are looked for [deg] …"""
DIGIT_TOLERANCE, ROUNDED_RATIO = 1e-4, 1.5
"""… the tolerance on multiples of one, as a share of it, and the factor within which the largest scatter is
what rounding makes: angles that were commanded in whole degrees scatter by far less."""
MAX_CURVED_ROWS = 300
"""Maximum number of rows, evenly spread, from which curvatures of the likelihood are taken."""
TOLERANCE, MAX_STEPS, MAX_HALVINGS = 1e-6, 100, 20
"""Change of its logarithm that ends its search, and maximum numbers of steps and of halvings of one."""
JITTER = 1e-12


class Readings(NamedTuple):
    """Noise of joint readings, and its share of the residuals.

    Args:
        sigma: Standard deviation of every joint's reading [rad or m].
        share: Share of the position variance that it causes; of the rotation variance without positions.
        digit: Last digit of the angles that scatter most in the file, if rounding is why [deg]; else 0.
    """

    sigma: tuple[float, ...]
    share: float
    digit: float = 0.0

    @property
    def joints_that_scatter(self) -> tuple[int, ...]:
        """Joints that scatter far more than most others: rather a mechanical cause than the encoder."""
        sigma = np.array(self.sigma)
        return tuple(np.flatnonzero(sigma > OUTSTANDING_RATIO * np.median(sigma)).tolist())

    def text(self, chain: Chain) -> str:
        """`0.5 mrad`, or `0.5 mrad in joint 2, 0.1 mm in joint 3`; joints with exact readings are omitted."""
        sizes: dict[str, list[int]] = {}
        for j, sigma in enumerate(self.sigma):
            if sigma > 0.0:
                unit = "mrad" if turns(chain, j) else "mm"
                sizes.setdefault(f"{1e3 * sigma:.2g} {unit}", []).append(j)
        if len(sizes) == 1 and len(*sizes.values()) == len(self.sigma):
            return next(iter(sizes))
        return ", ".join(f"{size} in {joint_list(js)}" for size, js in sizes.items())


class _Residuals(NamedTuple):
    """Rows with the same components: residuals, stated variances, what was measured, by_joint, joints."""

    residual: Float[np.ndarray, "rows m"]
    stated: Float[np.ndarray, "rows m"]
    live: Bool[np.ndarray, "rows m"]
    by_joint: Float[np.ndarray, "rows m n"]
    q: Float[np.ndarray, "rows n"]
    channel: np.ndarray
    """0, 1, 2 for the axes of positions, 3 for rotations."""

    @property
    def room(self) -> Float[np.ndarray, " rows"]:
        count = self.live.sum(1)
        return STUDENT_FREEDOM * np.array([consistent(m) for m in range(int(count.max()) + 1)])[count]


class _Answer(NamedTuple):
    """The most likely variance components, the variances they imply (channels, then joints), and the cost."""

    size: np.ndarray
    variances: np.ndarray
    cost: float


def readings(problem: Problem) -> Readings | None:
    """Noise of joint readings in a problem's weights, with its share of the residuals; None if they are
    exact."""
    if not any(problem.noise.joints):
        return None
    mine = problem.channels[0] if problem.channels[0].any() else problem.inverse_sigma > 0.0
    alone = (problem.inverse_sigma[mine] ** -2.0).sum()
    share = float(1.0 - alone / (problem.sigma[mine] ** 2).sum())
    return Readings(problem.noise.joints, share, _last_digit(problem))


def _last_digit(problem: Problem) -> float:
    """Last digit of the angles that scatter most [deg], if rounding to it makes most of that; else 0."""
    scatter = np.array([s * turns(problem.robot.chain, j) for j, s in enumerate(problem.noise.joints)])
    angles = np.rad2deg(problem.data.q[:, np.argmax(scatter)])
    for digit in DIGITS if scatter.any() else ():
        if np.abs(angles / digit - np.round(angles / digit)).max() < DIGIT_TOLERANCE:
            rounding = np.deg2rad(digit) / np.sqrt(12.0)
            return digit if rounding < ROUNDED_RATIO * scatter.max() < ROUNDED_RATIO**2 * rounding else 0.0
    return 0.0


def with_joint_readings(problem: Problem, x: Float[np.ndarray, " p"], factor: Factor) -> Noise | None:
    """Those of `beyond_stated`, with noise of joint readings if these are clearly noisy."""
    white, share = beyond_stated(problem, x, factor), spare_share(problem, x, factor)
    if white is None or share is None or share * problem.count < MIN_SPARE_FREEDOM:
        return white
    stated = bool((problem.own_sigma > 0.0).any())
    scale = _scale(tables := _tables(problem, x, share))
    joints = np.flatnonzero((scale[CHANNELS:] > 0.0) & (scale[CHANNELS:] < MAX_READING_ERROR**2))
    turning = np.array([turns(problem.blocks[0].arm.chain, j) for j in range(len(scale) - CHANNELS)])
    smooth, new = list[int](), [-1]
    while new:
        found = _likeliest(tables, scale, np.setdiff1d(joints, smooth), turning, stated)
        noisy = [int(j) for j in joints if found.variances[CHANNELS + j] > 0.0]
        new = [j for j in noisy if any(_is_smooth(tables, found.variances, j, k) for k in (j, *smooth))]
        if len(new) == len(noisy):
            return white
        smooth += new
    variances = found.variances.copy()
    variances[CHANNELS:] *= variances[CHANNELS:] > MIN_READING_VARIANCE * scale[CHANNELS:]
    if not stated:  # residuals keep their size, whatever their tails
        sizes = [_whitened(t, variances)[2] ** 2 for t in tables]
        variances = variances * (sum(s.sum() for s in sizes) / sum(t.live.sum() for t in tables))
    size = np.sqrt([variances[:3].mean(), *variances[3:]])
    position, rotation = np.where(scale[[0, 3]] > 0.0, size[:2], white[:2]).tolist()
    return Noise(position, rotation, tuple(size[2:].tolist()), tilt=white.tilt)


def alike_readings(problem: Problem, x: Float[np.ndarray, " p"]) -> Noise:
    """The most likely standard deviations where joint readings certainly scatter, all with equal noise."""
    scale = _scale(tables := _tables(problem, x, spare_share(problem, x) or 1.0))
    found = _fit(tables, _members(scale, [np.arange(len(scale) - CHANNELS)]), False)
    position, rotation, *joints = np.sqrt(found.variances[2:]).tolist()
    return Noise(position, rotation, tuple(joints))


def _likeliest(
    tables: Sequence[_Residuals], scale: np.ndarray, joints: np.ndarray, turning: np.ndarray, stated: bool
) -> _Answer:
    """The most likely variances: of joints only if rows clearly show that their readings are noisy."""
    kinds, charge = turning[joints], 0.5 * np.log(sum(len(t.residual) for t in tables))
    alike = [joints[kinds == kind] for kind in (True, False) if (kinds == kind).any()]
    tried = list[_Answer]()
    for axes in (TOGETHER, APART):
        count, some, groups = len(axes), joints, alike
        plain = _fit(tables, _members(scale, [], axes), stated)
        own = [plain._replace(cost=plain.cost + charge * count)]
        if tried and own[0].cost >= tried[0].cost:
            break
        while len(groups):
            answer = _fit(tables, _members(scale, groups, axes), stated)
            noisy = (answer.size[count:] > MIN_READING_VARIANCE).sum()
            own.append(answer._replace(cost=answer.cost + charge * (count + noisy) + MIN_GAIN))
            sizes = answer.variances[CHANNELS + some] / scale[CHANNELS + some]
            if groups is not alike:  # if all together show noise, the one that explains least becomes exact
                best = min(own, key=lambda a: a.cost)
                stays = (sizes > max(sizes.min(), MIN_READING_VARIANCE)) & (own[0] is not best)
                some = some[stays]
            fewer = answer.cost + charge * count + MIN_GAIN  # the least that any of them costs
            groups = list(some[:, None]) if groups is alike or fewer < min(a.cost for a in own) else []
        tried += own
    return min(tried, key=lambda a: a.cost)


def _is_smooth(tables: Sequence[_Residuals], variances: np.ndarray, joint: int, by: int) -> bool:
    """Whether the most likely errors of a joint's readings follow the angle of one: an effect, not noise."""
    q, error = [], []
    for table in tables:
        inverse, _, white = _whitened(table, variances)
        error.append(((inverse @ table.by_joint[:, :, [joint]])[..., 0] * white).sum(1))
        q.append(table.q[:, by])
    ordered = np.concatenate(error)[np.argsort(np.concatenate(q), kind="stable")]
    pairs = ordered[1:] * ordered[:-1]
    return bool(pairs.sum() > SMOOTH_DEVIATIONS * np.sqrt((pairs**2).sum()))


def _tables(problem: Problem, x: np.ndarray, share: float) -> list[_Residuals]:
    """At most `MAX_NOISE_ROWS` rows, grouped by their components; residuals scaled for the spare share."""
    residual = problem.physical(problem.residual(x)) / np.sqrt(share)
    every = slice(None, None, max(1, -(-len(problem.data) // MAX_NOISE_ROWS)))
    alike: dict[tuple[int, ...], list[tuple[np.ndarray, ...]]] = {}
    for block in problem.blocks:
        if Channel.TILT in block.observation.channels:
            continue
        live = (block.inverse_sigma > 0.0)[every]
        left, own = (
            values[block.start : block.stop].reshape(block.inverse_sigma.shape)[every] * live
            for values in (residual, problem.own_sigma**2)
        )
        part = left, own, live, block.by_joint[every] * live[..., None], block.q[every]
        axes = tuple(3 if c is Channel.ROTATION else k % 3 for k, c in enumerate(block.observation.channels))
        alike.setdefault(axes, []).append(part)
    return [
        _Residuals._make([*map(np.concatenate, zip(*parts, strict=True)), np.array(axes)])
        for axes, parts in alike.items()
    ]


def _scale(tables: Sequence[_Residuals]) -> Float[np.ndarray, " v"]:
    """Variance of each channel, then of each joint's readings, that alone would explain the residuals; 0 for
    unobservable joints."""
    square, count = np.zeros(2), np.zeros(2)
    for t in tables:
        square += np.bincount(t.channel // 3, (t.residual**2).sum(0), 2)
        count += np.bincount(t.channel // 3, t.live.sum(0), 2)
    mean = np.where(count > 0, np.maximum(square, 1e-300) / np.maximum(count, 1.0), 0.0)[[0, 0, 0, 1]]
    weigh = 1.0 / np.where(mean > 0.0, mean, 1.0)
    power = sum((t.by_joint**2 * weigh[t.channel][:, None]).sum((0, 1)) for t in tables)
    shown = power > 1e-12 * max(float(np.max(power)), 1e-300)
    return np.append(mean, np.where(shown, count.sum() / np.where(shown, power, 1.0), 0.0))


def _members(scale: np.ndarray, groups: Iterable[np.ndarray], axes=TOGETHER) -> Float[np.ndarray, "v k"]:
    """Which variances share a component: axes of positions, rotations, each group of joints."""
    every = [*axes, *(CHANNELS + group for group in groups)]
    out = np.zeros((len(scale), len(every)))
    for k, group in enumerate(every):
        out[group, k] = scale[group].min()
    return out


def _fit(tables: Sequence[_Residuals], members: np.ndarray, stated: bool) -> _Answer:
    """The most likely components ≥ 0, by Fisher scoring."""
    from scipy import optimize

    size = np.where(members[:CHANNELS].any(0), 1.0, 0.1)
    least = MIN_VARIANCE_SHARE * (size == 1.0) * (not stated)
    value, slope, curved = _cost(tables, members, size)
    for _ in range(MAX_STEPS):
        scale = np.where(np.diagonal(curved) > 0.0, np.diagonal(curved), 1.0) ** -0.5
        root = np.linalg.cholesky(scale[:, None] * curved * scale + JITTER * np.eye(len(scale)))
        right = root.T @ ((size - least) / scale) - np.linalg.solve(root, scale * slope)
        step = least + scale * optimize.nnls(root.T, right)[0] - size
        shorter = (size + 0.5**k * step for k in range(MAX_HALVINGS if -slope @ step > TOLERANCE else 0))
        tried = ((trial, *_cost(tables, members, trial)) for trial in shorter)
        if (better := next((t for t in tried if t[1] < value), None)) is None:
            break
        size, value, slope, curved = better
    return _Answer(size, members @ size, value)


def _whitened(table: _Residuals, variances: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inverse lower roots of the covariances, their log determinants, whitened residuals.

    Raises:
        LinAlgError: a covariance is indefinite in floating point.
    """
    alone = np.where(table.live, np.maximum(table.stated + variances[table.channel], 1e-300), 1.0)
    scaled = table.by_joint * np.sqrt(variances[CHANNELS:])
    covariance = scaled @ scaled.transpose(0, 2, 1)
    diagonal = np.arange(alone.shape[1])
    covariance[:, diagonal, diagonal] += alone
    root = np.linalg.cholesky(covariance)
    log_det = 2.0 * np.log(root[:, diagonal, diagonal]).sum(1)
    inverse = np.linalg.inv(root)
    return inverse, log_det, (inverse @ table.residual[..., None])[..., 0]


def _cost(
    tables: Sequence[_Residuals], members: np.ndarray, size: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Negative log likelihood of components, its gradient, its expected curvature from some rows; infinite
    where covariances are indefinite in floating point."""
    value, slope, curved = 0.0, np.zeros(len(size)), np.zeros((len(size),) * 2)
    try:
        whitened = [_whitened(table, members @ size) for table in tables]
    except np.linalg.LinAlgError:
        return np.inf, slope, curved
    for table, (inverse, log_det, white) in zip(tables, whitened, strict=True):
        square, room, freedom = (white**2).sum(1), table.room, STUDENT_FREEDOM + table.live.sum(1)
        value += 0.5 * float((log_det + freedom * np.log1p(square / room)).sum())
        sides = np.concatenate([inverse * table.live[:, None], inverse @ table.by_joint], axis=2)
        along, own = (white[:, None] @ sides)[:, 0], (sides**2).sum(1)
        of = members[[*table.channel, *range(CHANNELS, len(members))]]
        slope += 0.5 * (own.sum(0) - (freedom / (room + square)) @ along**2) @ of
        few = slice(None, None, -(-len(white) // MAX_CURVED_ROWS))
        inner, share = sides[few].transpose(0, 2, 1) @ sides[few], 1.0 / (freedom[few, None] + 2.0)
        both = np.tensordot(freedom[few] * share[:, 0], inner**2, 1) - (own[few] * share).T @ own[few]
        curved += 0.5 * len(white) / len(inner) * (of.T @ both @ of)
    return value, slope, curved


def check_joint_noise(noise: Noise | None, joints: int) -> None:
    """Raise unless noise of joint readings is that of as many joints, or of none."""
    if noise is not None and len(noise.joints) not in (0, joints):
        text = f"noise of joint readings must be given for each of the {joints} joints"
        raise ShapeError(f"{text}, got {len(noise.joints)}", expected=joints, found=len(noise.joints))
