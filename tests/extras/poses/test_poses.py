"""Informative poses: within limits, never worse, the same for the same seed."""

import numpy as np
import pytest

from workbench.arm.linearisation import linearise
from workbench.extras.poses.climb import PoseClimb
from workbench.extras.poses.informative_poses import informative_poses
from workbench.plate.observability import INDICES


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("index", INDICES)
def test_informative_poses_are_better_and_within_limits(aria, index):
    found = informative_poses(aria, 5, index=index, rng=rng(1))
    low, high = aria.search_limits.T
    assert found.q.shape == (5, 6)
    assert ((found.q >= low) & (found.q <= high)).all()
    assert found.after == pytest.approx(INDICES[index].value(linearise(aria, found.q)))
    assert found.after > 1.05 * found.before
    again = informative_poses(aria, 5, index=index, rng=rng(1))
    assert np.array_equal(again.q, found.q)


def test_gradient_of_an_index_by_the_joint_positions(aria):
    q = rng(6).uniform(-0.9, 0.9, (5, 6))
    for index in INDICES.values():
        search = PoseClimb(aria, index, {})
        value, slope = search.value_and_gradient(q)
        direction = rng(7).normal(size=q.shape)
        step = 1e-5
        difference = (search.value(q + step * direction) - search.value(q - step * direction)) / (2 * step)
        assert value == pytest.approx(search.value(q))
        assert difference == pytest.approx((slope * direction).sum(), rel=1e-4)
