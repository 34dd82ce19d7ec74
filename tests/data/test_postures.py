"""Which rows are one posture: numbers of poses that a generator made, from joints that scatter or don't."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.data.dataset import Dataset
from workbench.data.postures import pose_units, postures, repeats, repeats_text


def agree(found, actual) -> bool:
    pairs = set(zip(found.tolist(), actual.tolist(), strict=True))
    return len(pairs) == len(set(found.tolist())) == len(set(actual.tolist()))


@given(seed=st.integers(0, 10**6), poses=st.integers(2, 60), visits=st.integers(1, 12))
def test_repeats_are_found_whatever_the_scatter(seed, poses, visits):
    rng = np.random.default_rng(seed)
    actual = rng.permutation(np.repeat(np.arange(poses), visits))
    scatter = np.radians(10 ** rng.uniform(-6, -2)) * rng.choice([0.0, 1.0])
    q = rng.uniform(-1.5, 1.5, (poses, 6))[actual]
    assert agree(postures(q + scatter * rng.standard_normal(q.shape)), actual)


@pytest.mark.parametrize("step", [0.005, 0.02, 0.1])
def test_a_slow_path_repeats_nothing(step):
    q = np.radians(step) * np.outer(np.arange(400), [1.0, -0.5, 0.3, 0.0, 0.8, 0.2])
    assert len(set(postures(q))) == len(q)
    assert agree(postures(np.vstack([q, q[:10]])), np.r_[np.arange(400), np.arange(10)])


def test_groups_and_sessions():
    q = np.repeat(np.random.default_rng(0).uniform(-1, 1, (6, 6)), 2, axis=0)
    data = Dataset(q=q, position=np.arange(36.0).reshape(12, 3))
    assert pose_units(data).tolist() == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    grouped = replace(data, group=np.array(list("cccbbbaaaaaa")))
    assert pose_units(grouped).tolist() == [1] * 6 + [0] * 6  # one posture ties c and b; named by a, b
    assert pose_units(replace(data, group=np.full(12, "Pose"))).max() == 5
    assert len(set(pose_units(replace(data, session=np.array(list("ab") * 6))))) == 12
    named = replace(data, point=np.array(list("ab") * 6))
    assert [len(set(repeats(rows))) for rows in (data, named)] == [6, 12]
    assert repeats_text(data) == "6 poses, 2 readings each"
    assert repeats_text(data.take([0, 1, 2, 4])) == "3 poses, 1 to 2 readings each"
    assert not repeats_text(data.take([0, 2]))


def test_readings_of_one_place_are_one_posture_whatever_their_distances():
    assert not postures(np.outer([0.0, 0.0, 5e-5, 5e-5, 1e-4, 1.5e-4], np.ones(6))).any()
