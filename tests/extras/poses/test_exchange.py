"""Exchange against exhaustive search, the fast D-optimal one against direct determinants, its bound."""

from itertools import combinations, product

import numpy as np
import pytest

from workbench.base.progress import running
from workbench.base.types import Outcome
from workbench.extras.poses.d_optimal import (
    d_bound,
    d_exchange,
    greedy_choice,
    growths,
    prior,
    sandwich,
    spreads,
)
from workbench.plate.exchange import descend, exchange
from workbench.plate.observability import INDICES
from workbench.plate.optimality_criterion import criterion_of


def blocks(count=8, rows=2, size=3, seed=0):
    return np.random.default_rng(seed).normal(size=(count, rows, size))


def grams(some):
    return some.transpose(0, 2, 1) @ some


def o1(some):
    return np.linalg.det(np.tensordot(some, some, ((0, 1), (0, 1)))) ** (1 / (2 * some.shape[2])) / np.sqrt(
        len(some)
    )


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


def test_distinct_locked_and_cancelled():
    options = grams(blocks())
    allowed = np.ones((3, 8), bool)
    criterion = criterion_of(INDICES["O1"], 3)
    start = np.array([[0, 1, 2]])
    assert len(set(exchange(options, allowed, criterion, starts=start, distinct=True).choice)) == 3
    locked = np.array([True, False, True])
    found = exchange(options, allowed, criterion, starts=start, locked=locked)
    assert found.choice[[0, 2]].tolist() == [0, 2]
    with running(cancel=lambda: True):
        stopped = exchange(options, allowed, criterion, starts=start)
    assert stopped.outcome is Outcome.CANCELLED
    assert stopped.choice.tolist() == [0, 1, 2]
    shares = []
    with running(lambda share, text: shares.append(share)):
        exchange(options, allowed, criterion, starts=np.tile(start, (2, 1)))
    assert shares == [0.5, 1.0]


def test_low_rank_determinants_against_direct_ones():
    some = blocks(12, 6, 8)
    chosen = some[:3]
    information = np.tensordot(chosen, chosen, ((0, 1), (0, 1)))
    inverse = np.linalg.inv(information)
    flat = some.reshape(-1, 8)
    spread = spreads(some, flat, inverse)
    assert np.allclose(spread[4], some[4] @ inverse @ some[4].T)
    reach = inverse @ some[0].T
    cross = (flat @ reach).reshape(12, 6, 6)
    middle = np.linalg.inv(np.eye(6) - spread[0])
    gains = growths(spread, cross, middle) * np.linalg.det(np.eye(6) - spread[0])
    for j in range(12):
        direct = np.linalg.det(information - some[0].T @ some[0] + some[j].T @ some[j])
        assert gains[j] == pytest.approx(direct / np.linalg.det(information), rel=1e-9)
    spread += sandwich(cross, middle)
    without = np.linalg.inv(information - some[0].T @ some[0])
    assert np.allclose(spread, spreads(some, flat, without))


@pytest.mark.parametrize("seed", range(5))
def test_d_exchange_is_near_the_exhaustive_optimum_and_below_the_bound(seed):
    some = blocks(9, 2, 3, seed)
    found = d_exchange(some, 4)
    best = max(o1(some[list(c)]) for c in combinations(range(9), 4))
    assert len(set(found.choice.tolist())) == 4
    assert -found.cost == pytest.approx(o1(some[found.choice]))
    assert -found.cost > 0.97 * best
    assert best <= d_bound(some, 4) * (1 + 1e-9)


def test_d_exchange_never_falls_below_its_start():
    some = blocks(40, 6, 24, 1)
    for seed in range(4):
        start = np.random.default_rng(seed).choice(40, 8, replace=False)
        found = d_exchange(some, 8, start=start)
        assert -found.cost >= o1(some[start])
        assert list(found.history) == sorted(found.history, reverse=True)
    with running(cancel=lambda: True):
        stopped = d_exchange(some, 8, start=start)
    assert stopped.outcome is Outcome.CANCELLED
    assert np.array_equal(stopped.choice, start)


def test_greedy_choice_takes_the_greatest_determinant_step_by_step():
    some = blocks(10, 2, 4)
    chosen = greedy_choice(some, 4)
    information = prior(some)
    for slot, new in enumerate(chosen):
        dets = [
            -np.inf if j in chosen[:slot] else np.linalg.det(information + b.T @ b)
            for j, b in enumerate(some)
        ]
        assert new == np.argmax(dets)
        information = information + some[new].T @ some[new]


def test_greedy_choice_keeps_clashes_neighbours_and_its_first():
    some = blocks(12, 2, 3)
    group = np.arange(12) % 4
    found = greedy_choice(some, 6, clash=group[:, None] == group)
    assert sorted(group[found]) == [0, 1, 2, 3]
    near = np.abs(np.arange(12)[:, None] - np.arange(12)) <= 3
    path = greedy_choice(some, 5, follow=near, first=6)
    assert path[0] == 6
    assert len(set(path.tolist())) == 5
    assert (np.abs(np.diff(path)) <= 3).all()


def test_a_descent_ends_once_every_slot_in_a_row_has_kept_its_option():
    """Two slots of three fall once: a whole turn without change is enough, wherever in a round it ends."""
    falls, requested = {0: [1.0], 1: [2.0], 2: []}, []

    def improve(slot, cost):
        requested.append(slot)
        return cost - falls[slot].pop() if falls[slot] else cost

    assert descend((0, 1, 2), improve, 10.0) == ((10.0, 7.0, 7.0), Outcome.CONVERGED)
    assert requested == [0, 1, 2, 0, 1]
    assert descend((0,), lambda slot, cost: cost - 1.0, 3.0, rounds=2) == (
        (3.0, 2.0, 1.0),
        Outcome.ITERATION_LIMIT,
    )
    stops = iter((False, True))
    with running(cancel=lambda: next(stops)):
        found = descend((0, 1), lambda slot, cost: cost - 1.0, 3.0)
    assert found == ((3.0, 2.0), Outcome.CANCELLED)
