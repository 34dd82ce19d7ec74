"""Informative poses: joint positions whose measurement determines the parameters best.

For `O` this is the paper's method, ARIA eqs. (17), (18) and §4.1.2: random starts, each improved separately
within the joint limits. Every pose climbs to the maximum next to its own start, so the starts' spread is
kept: with one start for all, the maxima would be ten times the same pose. For the indices that judge the set
as a whole, poses are chosen greedily out of many candidates and exchanged for better ones, and the set is
then moved continuously within the joint limits. The result is never worse than the start.

Poses with limits are exchanged for neighbours that keep them instead.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from workbench.arm.linearisation import linearise
from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import part_of, progress
from workbench.base.types import Outcome, frozen
from workbench.extras.poses.climb import PoseClimb
from workbench.extras.poses.pose_limits import PoseLimits, sample_poses
from workbench.plate.exchange import Exchanged, by_determinant, of_information
from workbench.plate.free_constants import visible_basis
from workbench.plate.observability import O, goal_index

CANDIDATES = 300
"""Number of random candidates for a set …"""
LIMITED_CANDIDATES = 1000
"""… and with limits."""
NEARBY, NEIGHBOURS = (0.3, 0.1, 0.03), 20
"""How far random neighbours of a chosen pose may be [rad or m], one round each, and how many it has."""


@dataclass(frozen=True, eq=False)
class PoseSet:
    """A set of joint positions and its index.

    Args:
        q: Joint positions [rad or m], inside the limits, in no order: a short way through them would tie
            posture to time, and a drift of the instrument would look like an error of the arm.
        before: The index at the random start.
        after: The index of q, never below `before`.
    """

    q: Float[np.ndarray, "number n"]
    index: str
    before: float
    after: float
    outcome: Outcome


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
) -> PoseSet:
    """Choose joint positions with a large observability index.

    Args:
        index: `O`, `O1` … `O5`, or `I`: the predicted error at `evaluation_poses`.
        candidates: Joint positions to choose from, such as those of a `Dataset`; the result is then among
            them. Without, random ones, and the result is improved continuously if there are no limits.
        names: Constants to be identified, `base.…` and `tool.…` among them where these are unknown; the
            robot's default free ones if None.
        limits: Region and room.
        evaluation_poses: Evaluation poses for the index `I` [rad or m].
    """
    limits, basis = limits or PoseLimits(), visible_basis(robot, names)
    middle = linearise(robot, robot.search_limits.mean(1)[None], names=names)
    if index == "I" and evaluation_poses is None:
        text = "index I is the predicted error over evaluation poses; give a region or a plate"
        raise OptionError(text, option="evaluation_poses")
    goal = index if evaluation_poses is None or index != "I" else evaluation_poses
    climb = PoseClimb(robot, goal_index(goal, robot, middle, basis), names, basis)
    is_single = isinstance(climb.index, O)
    if not is_single:
        _check_enough(number, len(middle.names) if basis is None else basis.shape[1])
    is_free = candidates is None and not limits.checks(robot)
    if candidates is not None:
        pool = _admitted(robot, candidates, number, limits, rng)
    elif is_free:
        pool = sample_poses(robot, number if is_single else max(CANDIDATES, 5 * number), limits, rng=rng)
    else:
        pool = sample_poses(robot, max(LIMITED_CANDIDATES, 5 * number), limits, rng=rng)
    start, best, outcome = _chosen(climb, pool, number)
    before, q = climb.value(pool[start]), max((pool[start], pool[best]), key=climb.value)
    progress(0.6, f"raising {climb.index.name}")
    if is_free and outcome is not Outcome.CANCELLED:
        q, outcome = _climbed(climb, np.split(q, number) if is_single else [q])
    elif candidates is None and not is_single:
        q, outcome = _exchanged_nearby(climb, q, limits, rng)
    progress(1.0, "done")
    return PoseSet(frozen(q), climb.index.name, before, climb.value(q), outcome)


def _check_enough(number: int, parameters: int) -> None:
    minimum = -(-parameters // 6)
    if number < minimum:
        few = f"{number} poses give {number * 6} equations for {parameters} parameters"
        how = f"use at least {minimum} poses, or the index O of single poses"
        raise OptionError(f"{few}; {how}", option="number", found=number)


def _admitted(robot: Robot, q: np.ndarray, number: int, limits: PoseLimits, rng) -> np.ndarray:
    """The candidates that keep the joint limits and those given, in random order."""
    robot.check_joints(q, "candidates")
    low, high = robot.limits.T
    kept = q[((q >= low) & (q <= high)).all(1) & limits.admits(robot, q)]
    if len(kept) < number:
        few = f"{number} poses can't be chosen from {len(q)} candidates of which {len(kept)} keep the limits"
        raise DataError(f"{few}; give more candidates or relax the limits", found=len(kept))
    return rng.permutation(kept)


def _blocks(climb: PoseClimb, pool: np.ndarray) -> np.ndarray:
    linearisation = climb.at(pool)
    return linearisation.scaled.reshape(len(pool), -1, len(linearisation.names))


def _chosen(climb: PoseClimb, pool: np.ndarray, number: int) -> tuple[Sequence[int], Sequence[int], Outcome]:
    """Numbers of the candidates of a random start and of the best that were found, and how that ended.

    By an index of single poses each is improved by itself, as in the paper: candidates are dealt, each hand
    gives its best. By an index of the whole set they are chosen greedily and exchanged.
    """
    start = _dealt(-np.arange(len(pool)), number)
    if isinstance(climb.index, O):
        return start, _dealt(O().per_pose(climb.at(pool)), number), Outcome.CONVERGED
    blocks = _blocks(climb, pool)
    greedy = by_determinant(blocks, clash=np.eye(len(pool), dtype=bool)).fill(number)
    with part_of(0.0, 0.5, f"raising {climb.index.name}"):
        found = _exchanged(climb, blocks, [greedy, start])
    return start, found.choice.tolist(), found.outcome


def _dealt(gains: np.ndarray, number: int) -> list[int]:
    """The best of each hand of candidates."""
    return [int(hand[np.argmax(gains[hand])]) for hand in np.array_split(np.arange(len(gains)), number)]


def _exchanged(climb: PoseClimb, blocks: np.ndarray, starts: list[list[int]]) -> Exchanged:
    grams, clash = blocks.transpose(0, 2, 1) @ blocks, np.eye(len(blocks), dtype=bool)
    return of_information(grams, climb.index, len(starts[0]), clash=clash).from_each(starts)


def _exchanged_nearby(climb: PoseClimb, q: np.ndarray, limits: PoseLimits, rng) -> tuple[np.ndarray, Outcome]:
    """Poses exchanged for neighbours that keep the limits, nearer ones in each round."""
    outcome, joint_limits = Outcome.CONVERGED, climb.robot.search_limits.T
    for k, size in enumerate(NEARBY):
        moved = np.repeat(q, NEIGHBOURS, axis=0)
        moved = np.clip(moved + rng.uniform(-size, size, moved.shape), *joint_limits)
        pool = np.concatenate([q, moved[limits.admits(climb.robot, moved)]])
        with part_of(0.6 + 0.1 * k, 0.1, f"raising {climb.index.name}"):
            found = _exchanged(climb, _blocks(climb, pool), [list(range(len(q)))])
        q, outcome = pool[found.choice], found.outcome
    return q, outcome


def _climbed(climb: PoseClimb, parts: list[np.ndarray]) -> tuple[np.ndarray, Outcome]:
    """Each part climbs by itself."""
    found, outcome = [], Outcome.CONVERGED
    for k, part in enumerate(parts):
        better, ended = climb.climb(part)
        found.append(better)
        outcome = outcome if ended is Outcome.CONVERGED else ended
        progress(0.6 + 0.4 * (k + 1) / len(parts), f"raising {climb.index.name}")
        if ended is Outcome.CANCELLED:
            return np.concatenate([*found, *parts[k + 1 :]]), outcome
    return np.concatenate(found), outcome
