"""Informative poses: joint positions whose measurement shows the parameters best.

For `O` this is the paper's way, ARIA eqs. (17), (18) and §4.1.2: random starts, each improved by itself
within the joint limits. Every pose climbs to the maximum next to its own start, so the starts' spread is
kept: with one start for all, the maxima would be ten times the same pose. For O1 … O5, which judge the set
as a whole, poses are exchanged for better ones out of many candidates, and the set is then moved
continuously within the limits. Whatever happens, the result is never worse than the start.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import Bounds, minimize

from workbench.design.criterion import index_criterion
from workbench.design.dexchange import d_exchange
from workbench.design.exchange import exchange
from workbench.design.indices import O1, AbstractIndex, AbstractSetIndex, O, index_named
from workbench.design.region import Region
from workbench.design.sampling import random_poses
from workbench.errors import DataError, OptionError
from workbench.model.linearisation import linearise
from workbench.robots.robot import Robot
from workbench.types import Outcome, frozen

CANDIDATES = 300
"""Random candidates for a set, where none are given."""
STEP = 1e-5
"""Half-width of the central differences of the Jacobian [rad or m]; their error is about 1e-10."""
POLISH_STEPS = 100
"""Greatest number of steps of the continuous improvement."""

Progress = Callable[[float], None]
Cancel = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class PoseSet:
    """A set of joint positions and what it is worth.

    Args:
        q: Joint positions [rad or m], inside the limits.
        index: Name of the index.
        before: The index at the random start.
        after: The index of q, never below `before`.
        history: The index after each stage or step, start first.
        outcome: How the search ended.
    """

    q: Float[np.ndarray, "number n"]
    index: str
    before: float
    after: float
    history: tuple[float, ...]
    outcome: Outcome


class _Cancelled(Exception):
    """Leaves the optimiser when the user cancels."""


@dataclass(frozen=True)
class _Search:
    """One search: the arm, what is asked of the poses, and how to talk to the user."""

    robot: Robot
    index: AbstractIndex
    options: dict
    progress: Progress | None
    cancel: Cancel | None

    def value(self, q: np.ndarray) -> float:
        return self.index.value(linearise(self.robot, q, **self.options))

    def value_and_gradient(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """The index and its derivative by every joint position."""
        linearisation = linearise(self.robot, q, **self.options)
        rows, joints = q.shape
        outer = self.index.gradient(linearisation).reshape(rows, -1)
        moved = q[None, :, None, :] + STEP * np.array([1.0, -1.0])[:, None, None, None] * np.eye(joints)
        near = linearise(self.robot, moved.reshape(-1, joints), **self.options).jacobian
        plus, minus = near.reshape(2, rows, joints, -1)
        slope = np.einsum("rjk,rk->rj", plus - minus, outer) / (2.0 * STEP)
        return self.index.value(linearisation), slope

    def climb(self, q: np.ndarray) -> tuple[np.ndarray, list[float], Outcome]:
        """Local maximum of log(index) within the limits, from q; q itself if nothing is better."""
        start = self.value(q)
        best, history = (start, q), [start]
        if start <= 0.0:
            return q, history, Outcome.STALLED
        low, high = np.tile(self.robot.search_limits.T[:, None], (1, len(q), 1)).reshape(2, -1)

        def fall(x: np.ndarray) -> tuple[float, np.ndarray]:
            nonlocal best
            if self.cancel is not None and self.cancel():
                raise _Cancelled
            trial = x.reshape(q.shape)
            value, slope = self.value_and_gradient(trial)
            if value > best[0]:
                best = (value, trial.copy())
            if value <= 0.0:
                return 1e3, np.zeros_like(x)
            return -np.log(value), -slope.ravel() / value

        try:
            found = minimize(
                fall,
                q.ravel(),
                jac=True,
                method="L-BFGS-B",
                bounds=Bounds(low, high),
                options={"maxiter": POLISH_STEPS},
                callback=lambda _: history.append(best[0]),
            )
            outcome = (
                Outcome.CONVERGED
                if found.status == 0
                else Outcome.ITERATION_LIMIT
                if found.status == 1
                else Outcome.STALLED
            )
        except _Cancelled:
            outcome = Outcome.CANCELLED
        return best[1], [*history, best[0]], outcome


def informative_poses(
    robot: Robot,
    number: int,
    *,
    rng: np.random.Generator,
    index: str = "O1",
    candidates: Float[np.ndarray, "options n"] | None = None,
    names: tuple[str, ...] | None = None,
    region: Region | None = None,
    sigma_position: float = 1e-4,
    sigma_rotation: float | None = 3.490658503988659e-4,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> PoseSet:
    """Choose joint positions with a large observability index.

    Args:
        robot: Geometry with base, tool and limits.
        number: How many poses.
        rng: Source of the random starts and candidates.
        index: `O`, or `O1` … `O5`.
        candidates: Joint positions to choose from, such as those of a `Dataset`; the result is then among
            them. Without, random ones, and the result is improved continuously within the limits.
        names: Constants to be identified; the robot's default free ones if None.
        region: Where the tool has to be. The continuous improvement would leave it, so with a region the
            result is among the random candidates.
        sigma_position: Standard deviation of a measured coordinate [m].
        sigma_rotation: Standard deviation of a measured rotation [rad]; None for points.
        progress: Called with the share of the work done.
        cancel: Asked now and then whether to stop with the best poses so far.

    Raises:
        OptionError: no such index, no poses asked for, or too few for the parameters.
        DataError: fewer candidates than poses.
    """
    chosen = index_named(index)
    options = {"names": names, "sigma_position": sigma_position, "sigma_rotation": sigma_rotation}
    if number < 1:
        raise OptionError(f"{number} poses were asked for; give at least 1")
    if candidates is not None:
        robot.check_joints(candidates, "candidates")
        if len(candidates) < number:
            raise DataError(
                f"{number} poses can't be chosen from {len(candidates)} candidates; give more candidates"
            )
    search = _Search(robot, chosen, options, progress, cancel)
    free = candidates is None and region is None
    if isinstance(chosen, AbstractSetIndex):
        _check_enough(robot, number, options)
        return _set(search, chosen, number, candidates, region, rng, free)
    return _single(search, number, candidates, region, rng, free)


def _check_enough(robot: Robot, number: int, options: dict) -> None:
    parameters = len(robot.default_free if options["names"] is None else options["names"])
    rows = 3 if options["sigma_rotation"] is None else 6
    least = -(-parameters // rows)
    if number < least:
        raise OptionError(
            f"{number} poses give {number * rows} equations for {parameters} parameters; ask for at least "
            f"{least} poses, or for the index O, which looks at single poses"
        )


def _single(search, number, candidates, region, rng, free) -> PoseSet:
    """The paper's way: each random start is improved by itself, so that the spread of the starts is kept.

    Where the poses must stay candidates, these are dealt to the poses at random and each takes its best.
    """
    robot = search.robot
    if not free:
        pool = candidates
        if pool is None:
            pool = random_poses(robot, max(CANDIDATES, 5 * number), rng=rng, region=region)
        hands = np.array_split(rng.permutation(len(pool)), number)
        worth = O().per_pose(linearise(robot, pool, **search.options))
        before = search.value(pool[[hand[0] for hand in hands]])
        q = pool[[hand[np.argmax(worth[hand])] for hand in hands]]
        return _result(search, q, before, [before], Outcome.CONVERGED)
    q = random_poses(robot, number, rng=rng)
    before = search.value(q)
    outcome, history = Outcome.CONVERGED, [before]
    for row in range(number):
        better, _, ended = search.climb(q[row : row + 1])
        q[row] = better[0]
        history.append(search.value(q))
        if search.progress is not None:
            search.progress((row + 1) / number)
        outcome = outcome if ended is Outcome.CONVERGED else ended
        if ended is Outcome.CANCELLED:
            break
    return _result(search, q, before, history, outcome)


def _set(search, index, number, candidates, region, rng, free) -> PoseSet:
    """Exchange among candidates for the index of the whole set, then a continuous climb where free."""
    robot = search.robot
    count = max(CANDIDATES, 5 * number)
    pool = candidates if candidates is not None else random_poses(robot, count, rng=rng, region=region)
    linearisation = linearise(robot, pool, **search.options)
    blocks = linearisation.scaled.reshape(len(pool), -1, len(linearisation.names))
    start = rng.choice(len(pool), number, replace=False)
    before = search.value(pool[start])
    found = min(
        (d_exchange(blocks, number, start=s, cancel=search.cancel) for s in (None, start)),
        key=lambda result: result.cost,
    )
    if not isinstance(index, O1):
        found = exchange(
            blocks.transpose(0, 2, 1) @ blocks,
            np.ones((number, len(pool)), bool),
            index_criterion(index, number),
            starts=np.stack([found.choice, start]),
            distinct=True,
            progress=search.progress and (lambda share: search.progress(0.5 * share)),
            cancel=search.cancel,
        )
    q = pool[found.choice]
    value = search.value(q)
    if value < before:  # rounding only: no exchange raises the cost
        q, value = pool[start], before
    history, outcome = [before, value], found.outcome
    if free and outcome is not Outcome.CANCELLED:
        q, steps, outcome = search.climb(q)
        history += steps[1:]
    return _result(search, q, before, history, outcome)


def _result(search, q, before, history, outcome) -> PoseSet:
    after = search.value(q)
    if search.progress is not None:
        search.progress(1.0)
    return PoseSet(frozen(q), search.index.name, before, after, (*history, after), outcome)


__all__ = ["PoseSet", "informative_poses", "random_poses"]
