"""Exchange: one option for each of several slots, changed one at a time until no change helps.

Slots are the poses of a set and share all candidates, or they are the targets of a plate and each has its
own few inverse-kinematics solutions. From a start, every slot in turn takes the option that makes the
criterion smallest with the other slots as they stand; a local optimum is reached when a whole round
changes nothing (`descend`). Several starts guard against poor ones. The cost never rises above that of the
start. `optimiser/search.py` descends alike, with updates of its own.

Where a slot has many options, the criterion's slope ranks them, and only the best few that promise any gain
are tried: where the cost is convex, those that promise none bring none.

Source: Fedorov, Theory of Optimal Experiments (1972), §3; coordinate form of Meyer & Nachtsheim,
Technometrics 37(1), 1995.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.base.progress import cancelled, progress
from workbench.base.types import Outcome
from workbench.plate.optimality_criterion import AbstractCriterion

MAX_EXCHANGE_ROUNDS = 50
"""Maximum number of rounds from one start."""
OPTIONS_TRIED = 24
"""Options of a slot that are tried at a time."""


@dataclass(frozen=True, eq=False)
class Exchanged:
    """The best choice that was found.

    Args:
        choice: Option of each slot.
        cost: Its cost.
        history: Cost after each round of the start that won, its own cost first.
    """

    choice: Int[np.ndarray, " slots"]
    cost: float
    history: tuple[float, ...]
    outcome: Outcome


def descend(
    slots: Sequence[int],
    improve: Callable[[int, float], float],
    cost: float,
    *,
    rounds: int = MAX_EXCHANGE_ROUNDS,
) -> tuple[tuple[float, ...], Outcome]:
    """Give every slot in turn its best option, until a whole round changes none.

    Args:
        slots: Those that may change.
        improve: Gives a slot its best option; takes the cost before and returns that afterwards, the very
            same where nothing is changed.
        cost: Of the start.
        rounds: Maximum number of them.

    Returns:
        Cost of the start and after each round, and how it ended.
    """
    history, kept = [cost], 0  # slots in a row, over the rounds too, that have their best option already
    for _ in range(rounds):
        for slot in slots:
            if cancelled():
                return (*history, cost), Outcome.CANCELLED
            before, cost = cost, improve(slot, cost)
            kept = kept + 1 if cost == before else 0
            if kept == len(slots):
                break
        history.append(cost)
        if kept == len(slots):
            return tuple(history), Outcome.CONVERGED
    return tuple(history), Outcome.ITERATION_LIMIT


def exchange(
    options: Float[np.ndarray, "options p p"],
    allowed: Bool[np.ndarray, "slots options"],
    criterion: AbstractCriterion,
    *,
    starts: Int[np.ndarray, "starts slots"],
    clash: Bool[np.ndarray, "options options"] | None = None,
) -> Exchanged:
    """Choose an option for every slot so that the criterion of their summed information is smallest.

    Args:
        options: Information AᵀA of each option.
        allowed: Which options each slot may take.
        criterion: Cost of a stack of summed information.
        starts: Choices to start from, each tried in turn.
        clash: Which options must not be chosen together, itself where none may be taken twice; starts must
            keep it.
    """
    search = _ExchangeSearch(options, allowed, criterion, clash)
    best: Exchanged | None = None
    outcome = Outcome.CONVERGED
    for number, start in enumerate(starts):
        found, outcome = search.descend(start)
        if best is None or found.cost < best.cost:
            best = found
        progress((number + 1) / len(starts), "exchanging")
        if outcome is Outcome.CANCELLED:
            break
    assert best is not None
    ended = outcome if outcome is Outcome.CANCELLED else best.outcome
    return Exchanged(best.choice, best.cost, best.history, ended)


@dataclass(frozen=True, eq=False)
class _ExchangeSearch:
    options: np.ndarray
    allowed: np.ndarray
    criterion: AbstractCriterion
    clash: np.ndarray | None

    def descend(self, start) -> tuple[Exchanged, Outcome]:
        choice = start.copy()
        cost = float(self.criterion(self.options[choice].sum(0)[None])[0])
        history, outcome = descend(range(len(choice)), partial(self.improve, choice), cost)
        return Exchanged(choice, history[-1], history, outcome), outcome

    def improve(self, choice: np.ndarray, slot: int, cost: float) -> float:
        """Give a slot its best option; the cost afterwards."""
        total = self.options[choice].sum(0)
        numbers = self.promising(self.open_to(choice, slot), total, int(choice[slot]))
        if not len(numbers):
            return cost
        costs = self.criterion(total - self.options[choice[slot]] + self.options[numbers])
        minimum = int(np.argmin(costs))
        if costs[minimum] < cost - 1e-12 * abs(cost):
            choice[slot], cost = numbers[minimum], float(costs[minimum])
        return cost

    def open_to(self, choice: np.ndarray, slot: int) -> np.ndarray:
        """Options that a slot may take with the others as they are."""
        tried = self.allowed[slot]
        if self.clash is not None:
            tried = tried & ~self.clash[np.delete(choice, slot)].any(0)
        return np.flatnonzero(tried)

    def promising(self, numbers: np.ndarray, total: np.ndarray, old: int) -> np.ndarray:
        """The options whose first-order gain is largest, if there are many."""
        if len(numbers) <= OPTIONS_TRIED:
            return numbers
        slope = self.criterion.slope(total)
        gains = -np.tensordot(self.options[numbers] - self.options[old], slope, 2)
        best = np.argsort(-gains, kind="stable")[:OPTIONS_TRIED]
        return numbers[best[gains[best] > 0.0]]
