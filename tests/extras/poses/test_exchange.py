"""Exchange against exhaustive search, the greedy choice against direct determinants."""

from itertools import combinations, product

import numpy as np
import pytest

from workbench.base.progress import running
from workbench.base.types import Outcome
from workbench.extras.poses.greedy import greedy_choice, prior
from workbench.plate.exchange import descend, exchange
from workbench.plate.observability import INDICES
from workbench.plate.optimality_criterion import criterion_of

APART = np.eye(8, dtype=bool)


def blocks(count=8, rows=2, size=3, seed=0):
    return np.random.default_rng(seed).normal(size=(count, rows, size))


def grams(some):
    return some.transpose(0, 2, 1) @ some


@pytest.mark.parametrize("name", ["O1", "O2", "O3", "O4", "O5"])
def test_slots_with_their_own_options_reach_the_exhaustive_optimum(name):
    options = grams(blocks())
    allowed = np.repeat(np.eye(4, dtype=bool), 2, axis=1)  # four slots, two options each
    criterion = criterion_of(INDICES[name], 4)
    starts = np.array([[0, 2, 4, 6], [1, 3, 5, 7], [0, 3, 4, 7]])
    found = exchange(options, allowed, criterion, starts=starts)
    best = min(criterion(options[list(c)].sum(0)[None])[0] for c in product((0, 1), (2, 3), (4, 5), (6, 7)))
    assert found.cost == pytest.approx(best)
    assert allowed[np.arange(4), found.choice].all()
    assert list(found.history) == sorted(found.history, reverse=True)
    assert found.outcome is Outcome.CONVERGED


@pytest.mark.parametrize("seed", range(5))
def test_poses_that_clash_with_themselves_are_chosen_once_and_near_the_optimum(seed):
    some, criterion = blocks(seed=seed), criterion_of(INDICES["O1"], 4)
    options, start = grams(some), greedy_choice(some, 4, clash=APART)
    found = exchange(options, np.ones((4, 8), bool), criterion, starts=start[None], clash=APART)
    best = min(criterion(options[list(c)].sum(0)[None])[0] for c in combinations(range(8), 4))
    assert len(set(found.choice.tolist())) == 4
    assert best - 1e-12 <= found.cost < 0.97 * best
    assert found.cost <= criterion(options[start].sum(0)[None])[0] + 1e-12


def test_cancelled_and_shown():
    options, allowed, criterion = grams(blocks()), np.ones((3, 8), bool), criterion_of(INDICES["O1"], 3)
    start = np.array([[0, 1, 2]])
    with running(cancel=lambda: True):
        stopped = exchange(options, allowed, criterion, starts=start)
    assert stopped.outcome is Outcome.CANCELLED
    assert stopped.choice.tolist() == [0, 1, 2]
    shares = []
    with running(lambda share, text: shares.append(share)):
        exchange(options, allowed, criterion, starts=np.tile(start, (2, 1)))
    assert shares == [0.5, 1.0]


def test_greedy_choice_takes_the_greatest_determinant_step_by_step():
    some = blocks(8, 2, 4)
    chosen = greedy_choice(some, 4, clash=APART)
    information = prior(some)
    for slot, new in enumerate(chosen):
        dets = [
            -np.inf if j in chosen[:slot] else np.linalg.det(information + b.T @ b)
            for j, b in enumerate(some)
        ]
        assert new == np.argmax(dets)
        information = information + some[new].T @ some[new]


def test_greedy_choice_keeps_clashes_and_its_first():
    group = np.arange(12) % 4
    found = greedy_choice(blocks(12), 6, clash=group[:, None] == group, first=6)
    assert found[0] == 6
    assert sorted(group[found]) == [0, 1, 2, 3]


def test_a_descent_ends_once_every_slot_in_a_row_has_kept_its_option():
    """Two slots of three fall once: a whole turn without change is enough, wherever in a round it ends."""
    falls, requested = {0: [1.0], 1: [2.0], 2: []}, []

    def improve(slot, cost):
        requested.append(slot)
        return cost - falls[slot].pop() if falls[slot] else cost

    assert descend((0, 1, 2), improve, 10.0) == ((10.0, 7.0, 7.0), Outcome.CONVERGED)
    assert requested == [0, 1, 2, 0, 1]
    stops = iter((False, True))
    with running(cancel=lambda: next(stops)):
        found = descend((0, 1), lambda slot, cost: cost - 1.0, 3.0)
    assert found == ((3.0, 2.0), Outcome.CANCELLED)
