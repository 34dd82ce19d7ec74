"""Directions of motion from the order of the rows in time."""

import itertools

import numpy as np

from workbench.data.dataset import Dataset
from workbench.data.measuring_order import with_directions


def data(q, **more):
    q = np.atleast_2d(q).T if np.ndim(q) == 1 else q
    return Dataset(q=q, row=np.arange(len(q)), position=np.zeros((len(q), 3)), **more)


def test_a_plain_loop_that_begins_anew_in_every_session_agrees_on_random_runs():
    for seed in range(5):
        rng = np.random.default_rng(seed)
        q = np.round(rng.standard_normal((40, 3)), 0)
        time, session = rng.permutation(40).astype(float), rng.choice(["x", "y", "z"], 40)
        expected = np.zeros((40, 3))
        for name in "xyz":
            rows = sorted(np.flatnonzero(session == name), key=lambda r: time[r])
            for before, after in itertools.pairwise(rows):
                step = np.sign(q[after] - q[before])
                expected[after] = np.where(step == 0, expected[before], step)
        found = with_directions(data(q, time=time, session=session)).direction
        assert (found == expected).all()


def test_nothing_is_derived_where_the_file_says_it_or_has_no_time():
    own = data(np.arange(7.0), time=np.arange(7.0), direction=np.ones((7, 1)))
    assert with_directions(own) is own
    for time in (None, np.array([0, 1, 2, np.nan, 4, 5, 6])):
        rows = data(np.arange(7.0), time=time)
        assert with_directions(rows) is rows
