"""On which flank of its play each joint rests, row by row: searched for, since a step has no derivative.

While a fit holds the flanks s its cost is smooth. Then in each row the joint is turned that lowers it most,

    ½ |r(s)|² + [s ≠ sign τ] ½ (τ/τ₀)²

by the row's residuals and by its load τ, which masses and geometry leave uncertain by some τ₀, and so on
until no flank changes. Standard errors are those of that pattern. One joint at a time: two whose turn would
each do alone would otherwise turn to and fro.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from workbench.arm.effects.axes import own
from workbench.identification.algorithms.identifier import SearchOutcome
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.problem import Problem

PATTERNS = 8
"""Most patterns of flanks that are fitted."""
UNCERTAIN = 0.03
"""τ₀, as part of the load's standard deviation over the rows."""

Sides = Float[np.ndarray, "rows n"]


def search_flanks(
    algorithm: Opt2, problem: Problem, begin: Float[np.ndarray, " p"]
) -> tuple[Problem, SearchOutcome]:
    """The search from a beginning, and the problem with the flanks that it held in the end."""
    place = {name: i for i, name in enumerate(problem.names)}
    play = {
        j: place[n]
        for e in problem.robot.effects
        for j, n in zip(e.flanked, e.names[: len(e.flanked)], strict=True)
        if n in place
    }
    if not play:
        return problem, algorithm.search(problem, begin=begin)
    side, x = _by_load(_loads(problem, begin), play), begin
    fitted: list[tuple[float, Problem, SearchOutcome]] = []
    for _ in range(PATTERNS):
        held = _holding(problem, side)
        found = algorithm.search(held, begin=x)
        x, loads = found.x, _loads(held, found.x)
        against = side != _by_load(loads, play)
        strain = float(_strain(loads)[against & ~np.isnan(side)].sum())
        fitted.append((found.history[-1] + strain, held, found))
        last, side = side, _likelier(held, x, loads, side, play)
        if np.array_equal(side, last, equal_nan=True) or not found.outcome.ok:
            break
    _, held, found = min(fitted, key=lambda f: f[0])
    return held, found


def _loads(problem: Problem, x: Float[np.ndarray, " p"]) -> Sides:
    """Load of every joint about its axis [N m or N]."""
    joints = problem.data.joints
    out = np.zeros((len(problem.data), joints))
    for block in problem.blocks:
        out[block.rows] = own(block.chain, range(joints), block.wrenches(x))
    return out


def _by_load(loads: Sides, play: Mapping[int, int]) -> Sides:
    """Flanks as the loads have them; NaN for joints without play."""
    side = np.full(loads.shape, np.nan)
    side[:, list(play)] = np.where(loads[:, list(play)] < 0.0, -1.0, 1.0)
    return side


def _strain(loads: Sides) -> Sides:
    """What it costs to rest against the load."""
    return 0.5 * (loads / np.maximum(UNCERTAIN * loads.std(0), 1e-12)) ** 2


def _holding(problem: Problem, side: Sides) -> Problem:
    """The problem with flanks that don't change."""
    blocks = []
    for block in problem.blocks:
        assert block.deflected is not None, "play needs an arm with effects"
        held = replace(block.deflected.motion, flank=side[block.rows])
        blocks.append(replace(block, deflected=replace(block.deflected, motion=held)))
    return replace(problem, blocks=tuple(blocks))


def _likelier(held: Problem, x: np.ndarray, loads: Sides, side: Sides, play: Mapping[int, int]) -> Sides:
    """The flanks, in each row the one turned by which it becomes likelier most, if any does."""
    at, rows, out = held.evaluate(x), held.component_rows, side.copy()
    residual, gain = at.residual[: held.size], np.full(side.shape, -np.inf)
    for joint, place in play.items():
        change = 2.0 * x[place] * at.jacobian[: held.size, place]  # of the residual, by the other flank
        less = 0.5 * residual**2 - 0.5 * (residual + change) ** 2
        gain[:, joint] = np.bincount(rows, less, len(side))
    gain += np.where(side == _by_load(loads, play), -1.0, 1.0) * _strain(loads)
    best = np.argmax(gain, axis=1)
    turned = np.flatnonzero(gain.max(1) > 0.0)
    out[turned, best[turned]] *= -1.0
    return out
