"""Exchange: one option for each of several slots, changed one at a time until no change helps.

Slots are the poses of a set and share all candidates, or they are the targets of a plate and each has its
own few inverse-kinematics solutions. From a start, every slot in turn takes the option that makes the
criterion smallest with the other slots as they stand; a local optimum is reached when a whole round
changes nothing. Several starts guard against poor ones. The cost never rises above that of the start.

Source: Fedorov, Theory of Optimal Experiments (1972), §3; coordinate form of Meyer & Nachtsheim,
Technometrics 37(1), 1995.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.design.criterion import Criterion
from workbench.types import Outcome

ROUNDS = 50
"""Greatest number of rounds from one start."""


@dataclass(frozen=True, eq=False)
class Exchanged:
    """The best choice that was found.

    Args:
        choice: Option of each slot.
        cost: Its cost.
        history: Cost after each round of the start that won, its own cost first.
        outcome: How the search ended.
    """

    choice: Int[np.ndarray, " slots"]
    cost: float
    history: tuple[float, ...]
    outcome: Outcome


def exchange(
    options: Float[np.ndarray, "options p p"],
    allowed: Bool[np.ndarray, "slots options"],
    criterion: Criterion,
    *,
    starts: Int[np.ndarray, "starts slots"],
    distinct: bool = False,
    locked: Bool[np.ndarray, " slots"] | None = None,
    progress: Callable[[float], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Exchanged:
    """Choose an option for every slot so that the criterion of their summed information is least.

    Args:
        options: Information AᵀA of each option.
        allowed: Which options each slot may take.
        criterion: Cost of a stack of summed information.
        starts: Choices to start from, each tried in turn.
        distinct: Whether two slots must not take the same option.
        locked: Slots that keep the option of their start.
        progress: Called with the share of the starts done.
        cancel: Asked between rounds whether to stop with the best choice so far.
    """
    best: Exchanged | None = None
    outcome = Outcome.CONVERGED
    for number, start in enumerate(starts):
        found, outcome = _descend(options, allowed, criterion, start, distinct, locked, cancel)
        if best is None or found.cost < best.cost:
            best = found
        if progress is not None:
            progress((number + 1) / len(starts))
        if outcome is Outcome.CANCELLED:
            break
    assert best is not None
    ended = outcome if outcome is Outcome.CANCELLED else best.outcome
    return Exchanged(best.choice, best.cost, best.history, ended)


def _descend(options, allowed, criterion, start, distinct, locked, cancel) -> tuple[Exchanged, Outcome]:
    choice = start.copy()
    total = options[choice].sum(0)
    cost = float(criterion(total[None])[0])
    history = [cost]
    outcome = Outcome.ITERATION_LIMIT
    for _ in range(ROUNDS):
        if cancel is not None and cancel():
            outcome = Outcome.CANCELLED
            break
        before = cost
        for slot in range(len(choice)):
            if locked is not None and locked[slot]:
                continue
            tried = allowed[slot].copy()
            if distinct:
                tried[np.delete(choice, slot)] = False
            numbers = np.flatnonzero(tried)
            costs = criterion(total - options[choice[slot]] + options[numbers])
            least = int(np.argmin(costs))
            if costs[least] < cost - 1e-12 * abs(cost):
                choice[slot], cost = numbers[least], float(costs[least])
                total = options[choice].sum(0)
        history.append(cost)
        if cost == before:
            outcome = Outcome.CONVERGED
            break
    return Exchanged(choice, cost, tuple(history), outcome), outcome
