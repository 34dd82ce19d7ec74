"""Random and informative poses: within limits, in the region, never worse, the same for the same seed."""

import numpy as np
import pytest
from refusals import refuses

from workbench.arm.built_in_arms import load_robot
from workbench.arm.frame import Frame
from workbench.arm.linearisation import linearise
from workbench.base.errors import DataError, OptionError, ShapeError
from workbench.base.progress import running
from workbench.base.types import Outcome
from workbench.extras.poses.gradient import PoseClimb
from workbench.extras.poses.informative_poses import informative_poses
from workbench.plate.observability import INDICES
from workbench.plate.poses.sampling import in_base, random_poses
from workbench.plate.region import Region

BOX = Region(min=np.array([0.05, 0.10, 0.15]), max=np.array([0.60, 0.60, 0.45]))


def within(robot, q) -> bool:
    low, high = robot.search_limits.T
    return bool((q >= low).all() and (q <= high).all())


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("name", ["aria", "katana450", "iiwa14"])
def test_random_poses_keep_the_limits(name):
    robot = load_robot(name)
    q = random_poses(robot, 200, rng=rng())
    assert q.shape == (200, robot.dof)
    assert within(robot, q)


def test_random_poses_in_a_region_of_a_base_elsewhere(aria):
    turned = aria.with_frames(base=Frame(np.array([5.0, 1.0, 0.0]), np.diag([-1.0, -1.0, 1.0])))
    q = random_poses(turned, 30, rng=rng(), region=BOX)
    assert q.shape == (30, 6)
    assert BOX.contains(in_base(turned, q)[:, :3, 3]).all()
    assert np.array_equal(q, random_poses(aria, 30, rng=rng(), region=BOX))


def test_a_region_out_of_reach_is_said(aria):
    far = Region(min=np.array([5.0, 5.0, 5.0]), max=np.array([6.0, 6.0, 6.0]))
    with refuses(DataError, "[5.0, 5.0, 5.0] to [6.0, 6.0, 6.0]", "0 of 12000"):
        random_poses(aria, 1, rng=rng(), region=far)


@pytest.mark.parametrize("index", INDICES)
def test_informative_poses_are_never_worse_and_within_limits(aria, index):
    found = informative_poses(aria, 5, index=index, rng=rng(1))
    assert found.q.shape == (5, 6)
    assert within(aria, found.q)
    assert found.after >= found.before
    assert found.after == pytest.approx(INDICES[index].value(linearise(aria, found.q)))
    assert found.after > 1.05 * found.before
    assert found.history[0] == found.before
    assert found.history[-1] == found.after
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
    for index in ("O", "O1", "O2"):
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
