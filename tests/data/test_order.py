"""Rows in the order in which they were measured."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

import workbench as wb
from workbench.data.measuring_order import beside, with_directions


def test_a_part_of_the_same_file_is_not_of_later_and_another_file_is():
    """Held-out rows that somebody took from the file lie on either side of what happened in it."""
    data = wb.Dataset(q=np.zeros((6, 1)), position=np.zeros((6, 3)), source="arm.csv")
    kept, held = data.take(np.array([0, 2, 3, 5])), data.take(np.array([1, 4]))
    assert not beside(held, kept).is_of_later
    assert beside(replace(held, source="other.csv"), kept).is_of_later
    assert (data.take(np.arange(6)) is data, beside(data, kept).is_of_later) == (True, True)  # same numbers


def test_a_plain_loop_that_begins_anew_in_every_session_agrees_on_random_runs():
    for seed in range(5):
        rng = np.random.default_rng(seed)
        q = np.round(rng.standard_normal((40, 3)), 0)
        time, session = rng.permutation(40).astype(float), rng.choice(["x", "y", "z"], 40)
        expected = np.zeros((40, 3))
        for name in "xyz":
            rows = sorted(np.flatnonzero(session == name), key=lambda r: time[r])
            for before, after in pairwise(rows):
                step = np.sign(q[after] - q[before])
                expected[after] = np.where(step == 0, expected[before], step)
        found = with_directions(wb.Dataset(q=q, time=time, session=session)).direction
        assert (found == expected).all()


def test_nothing_is_derived_where_the_file_says_it_or_has_no_time():
    own = wb.Dataset(q=np.eye(7), time=np.arange(7.0), direction=np.ones((7, 7)))
    assert with_directions(own) is own
    for time in (None, np.array([0, 1, 2, np.nan, 4, 5, 6])):
        rows = wb.Dataset(q=np.eye(7), time=time)
        assert with_directions(rows) is rows
