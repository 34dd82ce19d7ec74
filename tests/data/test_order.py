"""Rows in the order in which they were measured, and sessions from one of them on."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

import workbench as wb
from workbench import read_measurements, split_sessions, write_measurements
from workbench.base.errors import DataError
from workbench.data.measuring_order import beside, clock_of, with_directions

NAMES = st.sampled_from(["", "A", "B", "A from row 3", "before row 3", "from row 3"])


@st.composite
def rows(draw):
    """Rows with or without sessions and times, in any order."""
    count = draw(st.integers(2, 12))
    session = draw(st.none() | st.lists(NAMES, min_size=count, max_size=count))
    time = draw(st.none() | st.permutations(range(count)))
    number = draw(st.permutations(range(count + 3)))[:count]
    return wb.Dataset(
        q=np.zeros((count, 1)),
        session=session,
        time=time,
        row=np.array(number),
        position=np.eye(3)[:1].repeat(count, 0),
    )


@given(rows(), st.data())
def test_rows_share_a_session_as_before_but_never_across_the_row(data, drawn):
    place = drawn.draw(st.integers(0, len(data) - 1))
    clock = clock_of(data)[0]
    side = clock >= clock[place]
    old = np.asarray(data.session if data.session is not None else [""] * len(data)).tolist()
    wanted = np.array(
        [[a == b and s == t for b, t in zip(old, side, strict=True)] for a, s in zip(old, side, strict=True)]
    )
    if not set(np.array(old)[side]) & set(np.array(old)[~side]):
        with refuses(DataError, row=int(data.row[place])):
            split_sessions(data, int(data.row[place]))
        return
    new = split_sessions(data, int(data.row[place]))
    assert np.array_equal(new.session[:, None] == new.session[None], wanted)
    if data.session is not None:
        assert (new.session[~side] == data.session[~side]).all()
    for name in ("q", "row", "position"):
        assert np.array_equal(getattr(new, name), getattr(data, name))
    assert len(new.notes) == len(data.notes) + 1


def test_a_second_event_splits_the_rows_after_the_first_one_and_all_are_written(tmp_path):
    data = wb.Dataset(q=np.zeros((9, 1)), position=np.zeros((9, 3)))
    once = wb.split_sessions(data, 6)
    both = wb.split_sessions(once, 3)
    assert both.session.tolist() == ["before row 6"] * 3 + ["from row 3"] * 3 + ["from row 6"] * 3
    assert len(wb.split_sessions(once, 7).sessions) == 3
    back = read_measurements(write_measurements(both, tmp_path / "rows.csv"))
    assert back.session.tolist() == both.session.tolist()


def test_a_part_of_the_same_file_is_not_of_later_and_another_file_is():
    """Held-out rows that somebody took from the file lie on either side of what happened in it."""
    data = wb.Dataset(q=np.zeros((6, 1)), position=np.zeros((6, 3)), source="arm.csv")
    kept, held = data.take(np.array([0, 2, 3, 5])), data.take(np.array([1, 4]))
    assert not beside(held, kept).is_of_later
    assert beside(replace(held, source="other.csv"), kept).is_of_later
    assert beside(data, kept).is_of_later  # a file of that name with rows of the same numbers


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
