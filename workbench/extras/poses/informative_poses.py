"""Informative poses: joint positions whose measurement determines the parameters best.

For `O` this is the paper's method, ARIA eqs. (17), (18) and §4.1.2: random starts, each improved separately
within the joint limits. Every pose climbs to the maximum next to its own start, so the starts' spread is
kept: with one start for all, the maxima would be ten times the same pose. For the indices that judge the set
as a whole, poses are chosen greedily out of many candidates and exchanged for better ones, and the set is
then moved continuously within its limits. The result is never worse than the start.

Limits (region, orientation cone, margins, spread, travel) are kept throughout; at the end the poses are put
in an order of measuring with short moves.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import linearise
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import part_of, progress
from workbench.base.types import Outcome, frozen
from workbench.extras.poses.d_optimal import d_bound, d_exchange, greedy_choice
from workbench.extras.poses.gradient import PoseClimb
from workbench.extras.poses.measurement_order import measuring_order, travels
from workbench.extras.poses.pose_limits import PoseLimits, feasible_start, folded, sample_poses, walks
from workbench.plate.exchange import Exchanged, exchange
from workbench.plate.free_constants import visible_basis
from workbench.plate.observability import INDICES, AbstractIndex, O
from workbench.plate.optimality_criterion import criterion_of, goal_index
from workbench.plate.poses.pose_choice import AbstractPoseChoice
from workbench.plate.poses.sampling import in_base, random_poses

CANDIDATES = 300
"""Number of random candidates for a set, if none are given."""
LIMITED_CANDIDATES = 1000
"""Number of random candidates if pairs of poses are limited."""
WALK = 25
"""Steps of the random walks that generate candidates if the travel is limited."""
D_OPTIMAL = ("O1", "D")
"""Indices maximised by the D-optimal choice."""


class Method(StrEnum):
    """How a set is chosen out of candidates."""

    EXCHANGE = "exchange"
    GREEDY = "greedy"


@dataclass(frozen=True, eq=False)
class PoseTask:
    """One selection of poses.

    Args:
        climb: The arm and the index.
        limits: Limits that they must keep.
        candidates: Joint positions to choose from; random ones if None.
        method: How a set is chosen out of candidates.
    """

    climb: PoseClimb
    number: int
    limits: PoseLimits
    candidates: np.ndarray | None
    method: Method
    rng: np.random.Generator

    @property
    def robot(self) -> Robot:
        return self.climb.robot

    @property
    def index(self) -> AbstractIndex:
        return self.climb.index

    def pool(self) -> np.ndarray:
        if self.candidates is None:
            count = max(LIMITED_CANDIDATES if self.limits.pairs else CANDIDATES, 5 * self.number)
            drawn = folded(self.robot, sample_poses(self.robot, count, self.limits, rng=self.rng))
            if self.limits.travel is None:
                return drawn
            walked = walks(self.robot, drawn[: max(count // WALK, 1)], WALK, self.limits, rng=self.rng)
            return np.concatenate([drawn, walked])
        kept = self.limits.admits(self.robot, self.candidates)
        if kept.sum() < self.number:
            raise DataError(
                f"{self.number} poses can't be chosen from {len(kept)} candidates of which {kept.sum()} keep "
                "the limits; give more candidates or relax the limits",
                found=int(kept.sum()),
            )
        return self.candidates[kept]

    def blocks(self, pool: np.ndarray) -> np.ndarray:
        linearisation = self.climb.at(pool)
        return linearisation.scaled.reshape(len(pool), -1, len(linearisation.names))

    def pairs(self, pool: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Which candidates exclude each other, and which may follow each other."""
        places = in_base(self.robot, pool)[:, :3, 3]
        return self.limits.clash(places), self.limits.follow(pool)


@dataclass(frozen=True, eq=False)
class PoseSet:
    """A set of joint positions and its index.

    Args:
        q: Joint positions [rad or m], inside the limits, in an order of measuring with short moves.
        before: The index at the random start.
        after: The index of q, never below `before`.
        history: The index after each stage or step, start first.
        bound: Proven upper bound of the index over all choices from the candidates; None where the poses
            were not chosen from given ones, or the index is not O1 or D.
    """

    q: Float[np.ndarray, "number n"]
    index: str
    before: float
    after: float
    history: tuple[float, ...]
    outcome: Outcome
    bound: float | None = None

    @property
    def travels(self) -> Float[np.ndarray, " steps"]:
        """Maximum travel of any joint from each pose to the next [rad or m]."""
        return travels(self.q)


def informative_poses(
    robot: Robot,
    number: int,
    *,
    rng: np.random.Generator,
    index: str = "O1",
    candidates: Float[np.ndarray, "options n"] | None = None,
    names: tuple[str, ...] | None = None,
    limits: PoseLimits | None = None,
    evaluation_poses: Float[np.ndarray, "rows n"] | None = None,
    method: Method = Method.EXCHANGE,
    sigma_position: float = 1e-4,
    sigma_rotation: float | None = 3.490658503988659e-4,
) -> PoseSet:
    """Choose joint positions with a large observability index.

    Args:
        index: `O`, `O1` … `O5`, `A`, `D`, or `I`: the predicted error at `evaluation_poses`.
        candidates: Joint positions to choose from, such as those of a `Dataset`; the result is then among
            them. Without, random ones, and the result is improved continuously within the limits.
        names: Constants to be identified, `base.…` and `tool.…` among them where these are unknown; the
            robot's default free ones if None.
        limits: Region, orientation cone, room, spread and travel.
        evaluation_poses: Evaluation poses for the index `I` [rad or m].
        method: Exchange after the greedy choice, or the greedy choice alone; both are then improved.
        sigma_position: Standard deviation of a measured coordinate [m].
        sigma_rotation: Standard deviation of a measured rotation [rad]; None for points.
    """
    if index == "I" and evaluation_poses is None:
        raise OptionError(
            "index I is the predicted error over evaluation poses; give a region or a plate",
            option="evaluation_poses",
        )
    if number < 1:
        raise OptionError(
            f"the number of poses must be at least 1, got {number}", option="number", found=number
        )
    if candidates is not None:
        robot.check_joints(candidates, "candidates")
        if len(candidates) < number:
            raise DataError(
                f"{number} poses can't be chosen from {len(candidates)} candidates; give more candidates",
                found=len(candidates),
            )
    options = {"names": names, "sigma_position": sigma_position, "sigma_rotation": sigma_rotation}
    limits = limits or PoseLimits()
    basis = visible_basis(robot, names, sigma_rotation=sigma_rotation)
    middle = linearise(robot, robot.search_limits.mean(1)[None], names=names)
    goal = index if evaluation_poses is None or index != "I" else evaluation_poses
    aim = goal_index(goal, robot, middle, basis)
    climb = PoseClimb(robot, aim, options, basis)
    task = PoseTask(climb, number, limits, candidates, method, rng)
    if isinstance(climb.index, O):
        return _single(task)
    _check_enough(number, len(middle.names) if basis is None else basis.shape[1], sigma_rotation)
    return _set(task)


def _check_enough(number: int, parameters: int, sigma_rotation: float | None) -> None:
    rows = 3 if sigma_rotation is None else 6
    minimum = -(-parameters // rows)
    if number < minimum:
        raise OptionError(
            f"{number} poses give {number * rows} equations for {parameters} parameters; use at least "
            f"{minimum} poses, or the index O of single poses",
            option="number",
            found=number,
        )


def _single(task: PoseTask) -> PoseSet:
    """As in the paper, each random start is improved by itself, so that the spread of the starts is kept.

    Where the poses must stay candidates or keep limits, candidates are dealt to them at random and each takes
    its best; where pairs are limited, a choice that keeps them is improved pose by pose. Poses that need not
    stay candidates then climb within the limits.
    """
    if task.candidates is None and not task.limits.single and not task.limits.pairs:
        return _climbed_one_by_one(task)
    pool = task.pool()
    hands = np.array_split(task.rng.permutation(len(pool)), task.number)
    gains = O().per_pose(task.climb.at(pool))
    before = task.climb.value(pool[[hand[0] for hand in hands]])
    if task.limits.pairs:
        clash, follow = task.pairs(pool)
        start = feasible_start(task.blocks(pool), task.number, task.limits, clash, follow, rng=task.rng)
        before = task.climb.value(pool[start])
        chosen = _best_single(start, gains, clash, follow)
    else:
        chosen = np.array([hand[np.argmax(gains[hand])] for hand in hands])
    q, history, outcome = pool[chosen], [before], Outcome.CONVERGED
    if task.candidates is None:
        q, steps, outcome = task.climb.climb_within(q, task.limits)
        history += steps
    return _result(task, q, before, history, outcome)


def _best_single(start, gains, clash, follow) -> np.ndarray:
    """Each pose of a feasible set in turn exchanged for the candidate of largest O that keeps the limits."""
    chosen = start.copy()
    for slot in range(len(chosen)):
        open_ones = ~clash[np.delete(chosen, slot)].any(0)
        for neighbour in (*chosen[max(slot - 1, 0) : slot], *chosen[slot + 1 : slot + 2]):
            open_ones &= True if follow is None else follow[neighbour]
        best = int(np.argmax(np.where(open_ones, gains, -np.inf)))
        chosen[slot] = best if gains[best] > gains[chosen[slot]] else chosen[slot]
    return chosen


def _climbed_one_by_one(task: PoseTask) -> PoseSet:
    q = folded(task.robot, random_poses(task.robot, task.number, rng=task.rng)).copy()
    before = task.climb.value(q)
    outcome, history = Outcome.CONVERGED, [before]
    for row in range(task.number):
        better, _, ended = task.climb.climb(q[row : row + 1])
        q[row] = better[0]
        history.append(task.climb.value(q))
        progress((row + 1) / task.number, f"raising {task.index.name}")
        outcome = outcome if ended is Outcome.CONVERGED else ended
        if ended is Outcome.CANCELLED:
            break
    return _result(task, q, before, history, outcome)


def _set(task: PoseTask) -> PoseSet:
    """Greedy choice and exchange among candidates for the index of the whole set, then a continuous climb."""
    pool = task.pool()
    blocks = task.blocks(pool)
    clash, follow = None, None
    if limited := task.limits.pairs:
        clash, follow = task.pairs(pool)
        start = feasible_start(blocks, task.number, task.limits, clash, follow, rng=task.rng)
    else:
        start = task.rng.choice(len(pool), task.number, replace=False)
    before = task.climb.value(pool[start])
    if task.method is Method.GREEDY and not limited:
        choice, outcome = greedy_choice(blocks, task.number), Outcome.CONVERGED
    elif task.method is Method.GREEDY:
        choice, outcome = start, Outcome.CONVERGED
    else:
        found = _exchanged(task, blocks, start, clash, follow)
        choice, outcome = found.choice, found.outcome
    progress(0.6, f"raising {task.index.name}")
    q, value = pool[choice], task.climb.value(pool[choice])
    if value < before:  # the greedy choice is of D-optimality; and rounding
        q, value = pool[start], before
    history = [before, value]
    bound = None
    if task.candidates is not None:
        bound = _bound(task, blocks)
    elif outcome is not Outcome.CANCELLED:
        free = not limited and not task.limits.single
        q, steps, outcome = task.climb.climb(q) if free else task.climb.climb_within(q, task.limits)
        history += steps[1:]
    return replace(_result(task, q, before, history, outcome), bound=bound)


def _exchanged(task: PoseTask, blocks, start, clash, follow) -> Exchanged:
    """Exchange for the task's index, from the start and, without limits on pairs, from the D-optimal set."""
    starts = [start]
    if clash is None:
        found = min(
            (d_exchange(blocks, task.number, start=s) for s in (None, start)), key=lambda result: result.cost
        )
        if task.index.name in D_OPTIMAL:
            return found
        starts = [found.choice, start]
    with part_of(0.0, 0.5, f"raising {task.index.name}"):
        return exchange(
            blocks.transpose(0, 2, 1) @ blocks,
            np.ones((task.number, len(blocks)), bool),
            criterion_of(task.index, task.number),
            starts=np.stack(starts),
            distinct=True,
            clash=clash,
            follow=follow,
        )


def _bound(task: PoseTask, blocks) -> float | None:
    """Upper bound of the index over all choices of candidates, where there is one."""
    if task.index.name not in D_OPTIMAL:
        return None
    bound = d_bound(blocks, task.number)
    return bound**2 if task.index.name == "D" else bound


def _result(task: PoseTask, q: np.ndarray, before: float, history, outcome: Outcome) -> PoseSet:
    ordered = q[measuring_order(q, longest=task.limits.travel)]
    after = task.climb.value(ordered)
    progress(1.0, "done")
    return PoseSet(frozen(ordered), task.index.name, before, after, (*history, after), outcome)


@final
class Informative(AbstractPoseChoice):
    """Of simulated measurements."""

    name = "informative"
    indices = INDICES

    def choose(
        self, robot: Robot, number: int, *, index: str, rng: np.random.Generator
    ) -> Float[np.ndarray, "number n"]:
        return informative_poses(robot, number, index=index, rng=rng).q
