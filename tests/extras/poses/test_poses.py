"""Informative poses: within limits, never worse, the same for the same seed."""

import numpy as np
import pytest
from refusals import refuses

from workbench.arm.linearisation import linearise
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.progress import running
from workbench.base.types import Outcome
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


def test_cancel_and_progress(aria):
    for index in ("O", "O2"):
        with running(cancel=lambda: True):
            stopped = informative_poses(aria, 5, index=index, rng=rng())
        assert stopped.outcome is Outcome.CANCELLED
        assert stopped.after >= stopped.before
    shares = []
    with running(lambda share, text: shares.append(share)):
        informative_poses(aria, 4, index="O", rng=rng())
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


def test_bad_input(aria):
    with refuses(OptionError, "O1", option="index", found="O7"):
        informative_poses(aria, 5, index="O7", rng=rng())
    with refuses(OptionError, "at least 4 poses", option="number", found=3):
        informative_poses(aria, 3, index="O1", rng=rng())
    with refuses(OptionError, option="number", found=0):
        informative_poses(aria, 0, index="O", rng=rng())
    with refuses(DataError, found=4):
        informative_poses(aria, 5, candidates=np.zeros((4, 6)), rng=rng())
    with pytest.raises(ShapeError):
        informative_poses(aria, 5, candidates=np.zeros((9, 7)), rng=rng())
