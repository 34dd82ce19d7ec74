"""Exchange against exhaustive search, the greedy choice against direct determinants."""

from itertools import combinations, product

import numpy as np
import pytest

from workbench.base.progress import running
from workbench.base.types import Outcome
from workbench.plate.exchange import RIDGE, Exchange, by_determinant, of_information
from workbench.plate.observability import INDICES

APART = np.eye(8, dtype=bool)


def blocks(count=8, rows=2, size=3, seed=0):
    return np.random.default_rng(seed).normal(size=(count, rows, size))


def grams(some):
    return some.transpose(0, 2, 1) @ some


@pytest.mark.parametrize("name", ["O1", "O2", "O3", "O4", "O5"])
def test_slots_with_their_own_options_reach_the_exhaustive_optimum(name):
    options = grams(blocks())
    allowed = np.repeat(np.eye(4, dtype=bool), 2, axis=1)  # four slots, two options each
    index = INDICES[name]
    starts = [[0, 2, 4, 6], [1, 3, 5, 7], [0, 3, 4, 7]]
    found = of_information(options, index, 4, allowed=allowed).from_each(starts)
    sets = [options[list(c)].sum(0) for c in product((0, 1), (2, 3), (4, 5), (6, 7))]
    assert -found.cost == pytest.approx(index.of_grams(np.array(sets), 4).max())
    assert allowed[np.arange(4), found.choice].all()
    assert found.outcome is Outcome.CONVERGED


@pytest.mark.parametrize("seed", range(5))
def test_poses_that_clash_with_themselves_are_chosen_once_and_near_the_optimum(seed):
    some, index = blocks(seed=seed), INDICES["O1"]
    options, start = grams(some), by_determinant(some, clash=APART).fill(4)
    found = of_information(options, index, 4, clash=APART).descend(start)
    sets = [options[list(c)].sum(0) for c in combinations(range(8), 4)]
    best = index.of_grams(np.array(sets), 4).max()
    assert len(set(found.choice.tolist())) == 4
    assert 0.97 * best < -found.cost <= best + 1e-12
    assert -found.cost >= index.of_grams(options[start].sum(0)[None], 4)[0] - 1e-12


def test_cancelled_and_shown():
    exchange, start = of_information(grams(blocks()), INDICES["O1"], 3), [0, 1, 2]
    with running(cancel=lambda: True):
        stopped = exchange.from_each([start])
    assert stopped.outcome is Outcome.CANCELLED
    assert stopped.choice.tolist() == [0, 1, 2]
    shares = []
    with running(lambda share, text: shares.append(share)):
        exchange.from_each([start, start])
    assert shares == [0.5, 1.0]


def test_greedy_choice_takes_the_greatest_determinant_step_by_step():
    some = blocks(8, 2, 4)
    chosen = by_determinant(some, clash=APART).fill(4)
    information = RIDGE * (some**2).sum() / (8 * 4) * np.eye(4)
    for slot, new in enumerate(chosen):
        dets = [
            -np.inf if j in chosen[:slot] else np.linalg.det(information + b.T @ b)
            for j, b in enumerate(some)
        ]
        assert new == np.argmax(dets)
        information = information + some[new].T @ some[new]


def test_greedy_choice_keeps_clashes_and_its_first():
    group = np.arange(12) % 4
    found = by_determinant(blocks(12), clash=group[:, None] == group).fill(6, [6])
    assert found[0] == 6
    assert sorted(group[found]) == [0, 1, 2, 3]


def test_a_descent_ends_once_every_slot_in_a_row_has_kept_its_option():
    """Two slots of three fall once: a whole turn without change is enough, wherever in a round it ends."""
    costs, requested = [9.0, 7.0, 5.0, 3.0, 1.0], []

    def options(chosen, slot):
        requested.append(slot)
        better = {0: [1], 1: [2]}.get(slot, [])  # for each slot one option is better, once
        return np.array([costs[o] if o in better and chosen[slot] != o else np.inf for o in range(5)])

    exchange = Exchange(options, lambda chosen: 10.0 - (chosen[0] == 1) - 2.0 * (chosen[1] == 2))
    found = exchange.descend([0, 0, 0])
    assert (found.choice.tolist(), found.cost) == ([1, 2, 0], 7.0)
    assert found.outcome is Outcome.CONVERGED
    assert requested == [0, 1, 2, 0, 1]
    stops = iter((False, True))
    with running(cancel=lambda: next(stops)):
        found = exchange.descend([0, 0])
    assert (found.cost, found.outcome) == (9.0, Outcome.CANCELLED)


def test_only_what_fits_is_taken_and_what_is_better_by_rounding_alone_is_not():
    """The best option does not fit; of the next one only the quick cost is smaller."""
    exact = {0: 4.0, 1: 1.0, 2: 4.0, 3: 3.0}
    exchange = Exchange(
        lambda chosen, slot: np.array([4.0, 1.0, 2.0, 3.0]),
        lambda chosen: exact[chosen[0]],
        fits=lambda option, others: option != 1,
    )
    assert exchange.descend([0]).choice.tolist() == [0]
    assert exchange.fill(2, [3]) == [3, 2]
