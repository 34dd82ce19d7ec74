"""Flank of its backlash on which each joint rests, row by row: a discrete search, since a step has no
derivative.

With fixed flanks s the cost of a fit is smooth. A row informs about a joint's flank twice: by the log odds D
of its residuals with either flank, and by the sign of the joint's load τ, which is uncertain with the masses
and centres m. Both also inform about the masses,

    p(m) ∝ N(m) Π [e^D Φ(τ(m)/τ₀) + Φ(−τ(m)/τ₀)],      τ(m) = τ + g·(m − m₀)

approximated by expectation propagation as a normal distribution with the same moments. Then in each row the
joint whose other flank is most favoured, by residuals and by the load as inferred from all other rows, is
switched, until no flank changes. Standard errors are those of the final pattern. One joint at a time, as two
joints either of which would suffice would otherwise switch back and forth.

Source: Minka, Expectation propagation for approximate Bayesian inference, Proc. UAI 2001; the sites are those
of a classifier with wrong labels.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy import special

from workbench.arm.effects.axes import own_components
from workbench.arm.statics.deflection import deflect
from workbench.arm.statics.wrenches import load_regressor
from workbench.base.types import Outcome
from workbench.diagnosis.search.candidates import acting
from workbench.identification.algorithms.identifier import SearchOutcome
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import Problem

PATTERNS = 12
"""Maximum number of flank patterns that are fitted."""
NO_GAIN = 0.999
"""The search ends if the misfit exceeds this multiple of the smallest one so far."""
SWEEPS, DAMPING = 40, 0.5
"""Maximum number of rounds of expectation propagation, and its damping."""
CONVERGED = 1e-3
"""Change of the masses' estimates [in their standard deviations] below which the rounds end."""
UNCERTAIN = 0.01
"""τ₀ relative to the load's standard deviation over rows and uncertain masses: friction and deflection."""
SCALES = 0.02, 0.1, 0.3, 1.0
"""Scales of the masses' stated standard deviations that are tried."""
MEDIAN = 0.455
"""95 % quantile of χ² with one degree of freedom."""
MAX_LOG_ODDS = 30.0
"""Log odds beyond which a flank counts as certain."""
FAR = 8.0
"""Standard deviations of a load from 0 beyond which its row carries no information on the masses."""

Sides = Float[np.ndarray, "rows j"]


@dataclass(frozen=True, eq=False)
class _BacklashLoads:
    """Loads about the axes of joints with backlash, and their dependence on the masses.

    Args:
        size: Loads for the prior masses, in units of τ₀.
        slope: Derivative in the V masses and centres, in units of τ₀ and their standard deviations.
    """

    size: Sides
    slope: Float[np.ndarray, "rows j v"]


@dataclass(frozen=True, eq=False)
class _Belief:
    """Information of the flanks on masses and loads.

    Args:
        mean: Of masses and centres, in standard deviations from the prior.
        precision: Precision added by the flanks, in these units.
        lean: Log odds of the positive flank due to the load, as inferred from the other rows.
    """

    mean: Float[np.ndarray, " v"]
    precision: Float[np.ndarray, "v v"]
    lean: Sides


def search_flanks(
    algorithm: Opt2, problem: Problem, begin: Float[np.ndarray, " p"]
) -> tuple[Problem, SearchOutcome]:
    """The search from an initial solution, and the problem with the final flanks."""
    play = _play(problem)
    if not play:
        return problem, algorithm.search(problem, begin=begin)
    belief: _Belief | None = None
    weighing = _weighing(problem)
    x, side, fitted = begin, _by_load(problem, begin), []
    for _ in range(PATTERNS):
        held = _holding(problem, side)
        if belief is not None:
            held, x = _believing(held, x, belief)
        found = algorithm.search(held, begin=x)
        x, is_weighed = found.x, belief is not None or not weighing
        odds, misfit = _odds(held, x, side)
        belief = _belief(_loads(held, x, side), odds)
        fitted.append((misfit, held, found))
        last, side = side, _likelier(side, odds + belief.lean)
        is_lost = found.outcome in (Outcome.CANCELLED, Outcome.DIVERGED)
        if is_lost or (is_weighed and np.array_equal(side, last)):
            break
        if len(fitted) > 2 and misfit > NO_GAIN * min(m for m, *_ in fitted[:-1]):
            break
    _, held, found = min(fitted[1:] or fitted, key=lambda f: f[0])
    return held, found


def holding_likeliest(problem: Problem, x: Float[np.ndarray, " p"]) -> Problem:
    """The problem with the most likely flanks at x."""
    if not _play(problem):
        return problem
    side = _by_load(problem, x)
    for _ in range(PATTERNS):
        held = _holding(problem, side)
        odds, _misfit = _odds(held, x, side)
        last, side = side, _likelier(side, odds + _belief(_loads(held, x, side), odds).lean)
        if np.array_equal(side, last):
            break
    return _holding(problem, side)


def _play(problem: Problem) -> dict[int, int]:
    """Joints with load-dependent backlash, and the indices of its unknown size."""
    place = {name: i for i, name in enumerate(problem.names)}
    return {
        j: place[n]
        for e in problem.robot.effects
        for j, n in zip(e.flanked, e.names[: len(e.flanked)], strict=True)
        if n in place
    }


def _weighing(problem: Problem) -> list[int]:
    """Indices of unknown masses and centres."""
    return [i for i, p in enumerate(problem.parameters) if p.is_inertia]


def _by_load(problem: Problem, x: Float[np.ndarray, " p"]) -> Sides:
    """Flanks that follow the loads at x."""
    middle = np.zeros((len(problem.data), len(_play(problem))))
    return np.where(_loads(problem, x, middle).size < 0.0, -1.0, 1.0)


def _loads(problem: Problem, x: Float[np.ndarray, " p"], side: Sides) -> _BacklashLoads:
    """Loads at x, each with its joint in the middle of its backlash while the others are on their flanks: on
    its own flank a joint with almost no load would confirm it."""
    joints, weighing = list(_play(problem)), _weighing(problem)
    size, slope = np.zeros(side.shape), np.zeros((*side.shape, len(weighing)))
    for k, joint in enumerate(joints):
        middle = side.copy()
        middle[:, k] = 0.0
        for block in _holding(problem, middle).blocks:
            arm, values = block.deflected, block.values(x)
            assert arm is not None, "backlash needs an arm with effects"
            weights, own = arm.weights(x), tuple(own_components(block.arm.chain, [joint])[0])
            trial = arm.at(x, values)
            deflected = deflect(trial, arm.motion)
            size[block.rows, k] = deflected.wrenches[:, *own]
            mine, columns = acting(problem, block)
            if weights is not None and len(mine):
                by_mass = load_regressor(trial, arm.motion, columns, shift=deflected.shift)
                there = np.ix_(block.rows, np.array([k]), np.searchsorted(weighing, mine))
                slope[there] = by_mass[:, None, *own]
    spread = np.array([problem.inertia_tolerance[problem.names[i]] for i in weighing])
    off = np.array([x[i] - problem.parameters[i].nominal for i in weighing]) / spread
    slope *= spread
    unit = np.maximum(UNCERTAIN * np.sqrt(size.var(0) + (slope**2).sum(2).mean(0)), 1e-12)
    slope /= unit[:, None]
    return _BacklashLoads(size / unit - slope @ off, slope)


def _holding(problem: Problem, side: Sides) -> Problem:
    """The problem with fixed flanks."""
    flank = np.full((len(side), problem.data.joints), np.nan)
    flank[:, list(_play(problem))] = side
    blocks = []
    for block in problem.blocks:
        assert block.deflected is not None, "backlash needs an arm with effects"
        held = replace(block.deflected.motion, flank=flank[block.rows])
        blocks.append(replace(block, deflected=replace(block.deflected, motion=held)))
    return replace(problem, blocks=tuple(blocks))


def _believing(
    problem: Problem, x: Float[np.ndarray, " p"], belief: _Belief
) -> tuple[Problem, Float[np.ndarray, " p"]]:
    """The problem with the masses' prior updated by the flanks, and x there."""
    weighing = _weighing(problem)
    if not weighing:
        return problem, x
    names = [problem.names[i] for i in weighing]
    spread = np.array([problem.inertia_tolerance[n] for n in names])
    values, vectors = np.linalg.eigh(belief.precision)
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T / spread
    x = x.copy()
    x[weighing] = [problem.parameters[i].nominal for i in weighing] + spread * belief.mean
    return problem.with_prior(names, x[weighing], root), x


def _odds(held: Problem, x: Float[np.ndarray, " p"], side: Sides) -> tuple[Sides, float]:
    """Log odds of the positive flanks due to the rows' residuals, the others fixed; and |r|².

    The odds use the noise that the fit leaves, since the assumed noise may be that of an arm without
    backlash.
    """
    at, rows = held.evaluate(x), held.component_rows
    residual, out = at.residual[: held.size], np.empty(side.shape)
    for k, place in enumerate(_play(held).values()):
        change = 2.0 * x[place] * at.jacobian[: held.size, place]  # derivative of the residual by the flank
        out[:, k] = np.bincount(rows, residual * change + 0.5 * change**2, len(side))
    variance = float(np.median(residual[held.inverse_sigma > 0.0] ** 2)) / MEDIAN
    return side * out / max(variance, 1e-12), float(residual @ residual)


def _belief(loads: _BacklashLoads, odds: Sides) -> _Belief:
    """Information of the flanks, with the smallest mass errors that they allow: a file may be more accurate
    than stated."""
    wide = np.sqrt(1.0 + (loads.slope**2).sum(2))
    near = np.abs(loads.size) < FAR * wide
    right = special.expit(np.clip(odds, -MAX_LOG_ODDS, MAX_LOG_ODDS))
    kinds = [Propagated.of(loads.size[near], s * loads.slope[near], right[near]) for s in SCALES]
    best = max(kinds, key=lambda k: k.evidence)
    scale = SCALES[kinds.index(best)]
    slope = scale * loads.slope
    mean, variance = slope @ best.mean, ((slope @ best.spread) * slope).sum(2)
    mean[near], variance[near] = best.free_mean, best.free_variance
    z = (loads.size + mean) / np.sqrt(1.0 + variance)
    near_slope = loads.slope[near]
    return _Belief(
        scale * best.mean,
        (near_slope.T * best.precision) @ near_slope,
        special.log_ndtr(z) - special.log_ndtr(-z),
    )


@dataclass(frozen=True, eq=False)
class Propagated:
    """Normal approximation of the masses' distribution given the flanks of K loads.

    Args:
        mean: Of the masses, in their prior standard deviations.
        spread: Their covariance.
        precision: Contribution of each load along its slope.
        free_mean: Cavity mean of each load's change, from all other loads.
        free_variance: Likewise.
        evidence: Log probability of the flanks.
    """

    mean: Float[np.ndarray, " v"]
    spread: Float[np.ndarray, "v v"]
    precision: Float[np.ndarray, " k"]
    free_mean: Float[np.ndarray, " k"]
    free_variance: Float[np.ndarray, " k"]
    evidence: float

    @classmethod
    def of(
        cls, size: Float[np.ndarray, " k"], slope: Float[np.ndarray, "k v"], right: Float[np.ndarray, " k"]
    ) -> "Propagated":
        """Expectation propagation, all loads at once; `right` is the probability of the positive flank by the
        residuals of a row."""
        precision, shift = np.zeros(len(size)), np.zeros(len(size))
        last: np.ndarray | float = np.inf  # at least one round
        for _ in range(SWEEPS):
            spread = np.linalg.inv(np.eye(slope.shape[1]) + (slope.T * precision) @ slope)
            mean = spread @ (slope.T @ shift)
            variance = ((slope @ spread) * slope).sum(1)
            share = np.maximum(1.0 - precision * variance, 1e-9)
            free_mean, free = (slope @ mean - variance * shift) / share, variance / share
            width = np.sqrt(1.0 + free)
            z = (size + free_mean) / width
            chance = right * special.ndtr(z) + (1.0 - right) * special.ndtr(-z)
            if np.abs(mean - last).max(initial=0.0) < CONVERGED:
                break
            last = mean
            slant = (2.0 * right - 1.0) * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi) / (chance * width)
            bend = np.maximum(slant * (slant + z / width), 0.0)
            less = 1.0 - free * bend
            precision = precision + DAMPING * (bend / less - precision)
            shift = shift + DAMPING * ((slant + free_mean * bend) / less - shift)
        own = free * shift**2 + 2.0 * free_mean * shift - free_mean**2 * precision
        own = 0.5 * (own / (1.0 + free * precision) - np.log1p(free * precision))
        evidence = float((np.log(chance) - own).sum() + 0.5 * mean @ (slope.T @ shift))
        evidence += 0.5 * float(np.linalg.slogdet(spread)[1])
        return cls(mean, spread, precision, free_mean, free, evidence)


def _likelier(side: Sides, odds: Sides) -> Sides:
    """The flanks, in each row with the one switched that gains most likelihood, if any does."""
    gain, out = -side * odds, side.copy()
    best = np.argmax(gain, axis=1)
    turned = np.flatnonzero(gain.max(1) > 0.0)
    out[turned, best[turned]] *= -1.0
    return out
