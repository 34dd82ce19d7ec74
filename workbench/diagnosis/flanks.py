"""On which flank of its play each joint rests, row by row: searched for, since a step has no derivative.

While a fit holds the flanks s its cost is smooth. A row tells a joint's flank twice: by the log odds D of its
residuals with the one and the other, and by the sign of the joint's load τ, which masses and centres m leave
uncertain. Together they tell of the masses as well, row by row,

    p(m) ∝ N(m) Π [e^D Φ(τ(m)/τ₀) + Φ(−τ(m)/τ₀)],      τ(m) = τ + g·(m − m₀)

by expectation propagation: the normal distribution that has the moments of this one serves as what is known
of the masses. Then in each row the joint is turned that is likelier on its other flank by most, by residuals
and by the load as all other rows have it, and so on until no flank changes. Standard errors are those of that
pattern. One joint at a time: two whose turn would each do alone would otherwise turn to and fro.

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
from workbench.diagnosis.candidate_columns import acting
from workbench.identification.algorithms.identifier import SearchOutcome
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.fit import Fit
from workbench.identification.problem import Problem

PATTERNS = 12
"""Most patterns of flanks that are fitted."""
NO_GAIN = 0.999
"""Part of the least misfit so far above which another pattern of flanks does not gain enough to go on."""
LOST = Outcome.CANCELLED, Outcome.DIVERGED
"""Fits after which no other pattern is tried."""
SWEEPS, DAMPING = 40, 0.5
"""Most rounds of expectation propagation, and the part of each change that is taken."""
CONVERGED = 1e-3
"""Change of what is known of masses [their standard deviations] that ends them."""
UNCERTAIN = 0.01
"""τ₀, as part of the load's standard deviation over the rows: friction, and what bends the arm."""
SCALES = 0.02, 0.1, 0.3, 1.0
"""Parts of their stated standard deviations by which masses may be off."""
TWO_SIDED = 1.96
"""Standard deviations either side of what is known with 95 %."""
MEDIAN = 0.455
"""Of the square of a normal variable with unit variance."""
SURE = 30.0
"""Log odds beyond which residuals say nothing more of masses."""
FAR = 8.0
"""Standard deviations of a load from 0 beyond which its row tells nothing of the masses."""

Sides = Float[np.ndarray, "rows j"]


@dataclass(frozen=True, eq=False)
class _Loads:
    """Loads about the axes of joints with play, and what flanks tell of them.

    Args:
        size: By the masses as known without the flanks, in units of τ₀.
        slope: Derivative in these, V of them, in units of τ₀ and their standard deviations.
        off: By how many of these the masses at x differ.
        unit: τ₀ of each joint [N m or N].
    """

    size: Sides
    slope: Float[np.ndarray, "rows j v"]
    off: Float[np.ndarray, " v"]
    unit: Float[np.ndarray, " j"]


@dataclass(frozen=True, eq=False)
class _Belief:
    """What flanks tell of masses and loads.

    Args:
        mean: Of masses and centres, in standard deviations from what is known without the flanks.
        precision: That the flanks add, in these units.
        lean: Log odds of the positive flank by the load, as the other rows have it.
    """

    mean: Float[np.ndarray, " v"]
    precision: Float[np.ndarray, "v v"]
    lean: Sides


def search_flanks(
    algorithm: Opt2, problem: Problem, begin: Float[np.ndarray, " p"]
) -> tuple[Problem, SearchOutcome]:
    """The search from a beginning, and the problem with the flanks that it held in the end."""
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
        if (is_weighed and np.array_equal(side, last)) or found.outcome in LOST:
            break
        if len(fitted) > 2 and misfit > NO_GAIN * min(m for m, *_ in fitted[:-1]):
            break
    _, held, found = min(fitted[1:] or fitted, key=lambda f: f[0])
    return held, found


def holding_likeliest(problem: Problem, x: Float[np.ndarray, " p"]) -> Problem:
    """The problem with the flanks that are likeliest at x."""
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


def open_flanks(fit: Fit) -> dict[int, tuple[float, float]]:
    """Joints of which the masses leave open on which flank they rest where their load is small: up to which
    load [N m or N], and in what part of the rows."""
    weighing, out = _weighing(fit.problem), {}
    if not weighing or not _play(fit.problem):
        return {}
    middle = np.zeros((len(fit.problem.data), len(_play(fit.problem))))
    loads = _loads(fit.problem, fit.x, middle)
    spread = np.array([fit.problem.inertia_tolerance[fit.problem.names[i]] for i in weighing])
    known = fit.covariance[np.ix_(weighing, weighing)] / np.outer(spread, spread)
    width = TWO_SIDED * np.sqrt(((loads.slope @ known) * loads.slope).sum(2))
    is_open = np.abs(loads.size + loads.slope @ loads.off) < width
    for k, joint in enumerate(_play(fit.problem)):
        if is_open[:, k].any():
            mine = width[is_open[:, k], k]
            out[joint] = float(np.median(mine) * loads.unit[k]), float(is_open[:, k].mean())
    return out


def _play(problem: Problem) -> dict[int, int]:
    """Joints with play that a load decides, and the places of its unknown size."""
    place = {name: i for i, name in enumerate(problem.names)}
    return {
        j: place[n]
        for e in problem.robot.effects
        for j, n in zip(e.flanked, e.names[: len(e.flanked)], strict=True)
        if n in place
    }


def _weighing(problem: Problem) -> list[int]:
    """Places of unknown masses and centres."""
    return [i for i, p in enumerate(problem.parameters) if p.is_inertia]


def _by_load(problem: Problem, x: Float[np.ndarray, " p"]) -> Sides:
    """Flanks as the loads at x have them."""
    middle = np.zeros((len(problem.data), len(_play(problem))))
    return np.where(_loads(problem, x, middle).size < 0.0, -1.0, 1.0)


def _loads(problem: Problem, x: Float[np.ndarray, " p"], side: Sides) -> _Loads:
    """Loads at x, each of a joint in the middle of its play while the others are on their flanks: on its own
    flank, a load that is nearly none would side with it."""
    joints, weighing = list(_play(problem)), _weighing(problem)
    size, slope = np.zeros(side.shape), np.zeros((*side.shape, len(weighing)))
    for k, joint in enumerate(joints):
        middle = side.copy()
        middle[:, k] = 0.0
        for block in _holding(problem, middle).blocks:
            arm, values = block.deflected, block.values(x)
            assert arm is not None, "play needs an arm with effects"
            weights, own = arm.weights(x), tuple(own_components(block.chain, [joint])[0])
            deflected = deflect(arm.robot, arm.motion, values=values, effects=arm.effects(x), weights=weights)
            size[block.rows, k] = deflected.wrenches[:, *own]
            mine, columns = acting(problem, block)
            if weights is not None and len(mine):
                by_mass = load_regressor(
                    arm.robot, arm.motion, weights, columns, values=values, shift=deflected.shift
                )
                slope[np.ix_(block.rows, np.array([k]), np.searchsorted(weighing, mine))] = by_mass[
                    :, None, *own
                ]
    unit = np.maximum(UNCERTAIN * size.std(0), 1e-12)
    spread = np.array([problem.inertia_tolerance[problem.names[i]] for i in weighing])
    off = np.array([x[i] - problem.parameters[i].nominal for i in weighing]) / spread
    slope *= spread / unit[:, None]
    return _Loads(size / unit - slope @ off, slope, off, unit)


def _holding(problem: Problem, side: Sides) -> Problem:
    """The problem with flanks that don't change."""
    flank = np.full((len(side), problem.data.joints), np.nan)
    flank[:, list(_play(problem))] = side
    blocks = []
    for block in problem.blocks:
        assert block.deflected is not None, "play needs an arm with effects"
        held = replace(block.deflected.motion, flank=flank[block.rows])
        blocks.append(replace(block, deflected=replace(block.deflected, motion=held)))
    return replace(problem, blocks=tuple(blocks))


def _believing(
    problem: Problem, x: Float[np.ndarray, " p"], belief: _Belief
) -> tuple[Problem, Float[np.ndarray, " p"]]:
    """The problem with masses known as the flanks have them, and x there."""
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
    """Log odds of the positive flanks by the rows' residuals, the others as they are; and |r|².

    The odds are those of the noise that the fit leaves: what was assumed may be that of an arm without play.
    """
    at, rows = held.evaluate(x), held.component_rows
    residual, out = at.residual[: held.size], np.empty(side.shape)
    for k, place in enumerate(_play(held).values()):
        change = 2.0 * x[place] * at.jacobian[: held.size, place]  # of the residual, by the other flank
        out[:, k] = np.bincount(rows, residual * change + 0.5 * change**2, len(side))
    variance = float(np.median(residual[held.inverse_sigma > 0.0] ** 2)) / MEDIAN
    return side * out / max(variance, 1e-12), float(residual @ residual)


def _belief(loads: _Loads, odds: Sides) -> _Belief:
    """What flanks tell, with masses off by as little as they allow: a file may know better than it says."""
    wide = np.sqrt(1.0 + (loads.slope**2).sum(2))
    near = np.abs(loads.size) < FAR * wide
    right = special.expit(np.clip(odds, -SURE, SURE))
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
    """A normal distribution in place of that of the masses, from the flanks of K loads.

    Args:
        mean: Of the masses, in the standard deviations that they were given.
        spread: Their covariance.
        precision: That each load brings along its slope.
        free_mean: Of each load's change, as all other loads have it.
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
        """Expectation propagation, all loads at once.

        Args:
            size: Loads by the masses as they were given.
            slope: Their derivative.
            right: Probability of the positive flank by a row's residuals.
        """
        precision, shift = np.zeros(len(size)), np.zeros(len(size))
        last: np.ndarray | float = np.inf  # so that the loads are propagated once at least
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
    """The flanks, in each row the one turned by which it becomes likelier most, if any does."""
    gain, out = -side * odds, side.copy()
    best = np.argmax(gain, axis=1)
    turned = np.flatnonzero(gain.max(1) > 0.0)
    out[turned, best[turned]] *= -1.0
    return out
