"""Reach margin, against arms that are made with errors and led to a target one at a time."""

import numpy as np
import pytest

from workbench import load_robot, tool_poses
from workbench.arm.inverse.follow import follow_many
from workbench.data.simulation.simulate import LIKELY_ERRORS, virtual_arm
from workbench.plate.reach_margin import with_reach_margin


@pytest.fixture(scope="module")
def ur5():
    return load_robot("ur5")


def elbow(angles) -> np.ndarray:
    """Postures with the elbow so far from straight [rad]."""
    q = np.tile(np.deg2rad([20.0, -60.0, 0.0, -70.0, 70.0, 10.0]), (len(angles), 1))
    q[:, 2] = angles
    return q


@pytest.mark.parametrize("errors", [LIKELY_ERRORS, (3e-3, float(np.deg2rad(1.5)))])
def test_postures_with_margin_are_those_that_made_arms_reach(ur5, errors):
    q = elbow(np.deg2rad([1.0, 3.0, 6.0, 10.0, 20.0, 40.0, 90.0]))
    has_margin = with_reach_margin(ur5, q, errors=errors)
    rng, poses = np.random.default_rng(0), tool_poses(ur5, q)
    made = [virtual_arm(ur5, rng=rng, errors=errors) for _ in range(60)]
    share = np.mean([follow_many(arm, poses, q).converged for arm in made], axis=0)
    assert has_margin.any()
    assert not has_margin.all()
    assert (share[has_margin] == 1.0).all()
    assert share[0] < 0.9
    assert (np.diff(has_margin.astype(int)) >= 0).all()  # once the elbow is bent enough, it stays so


def test_a_joint_at_its_limit_has_none_unless_others_make_up_for_it(ur5):
    q = elbow(np.deg2rad([60.0, 60.0]))
    q[1, 0] = ur5.limits[0, 1]
    assert with_reach_margin(ur5, q).tolist() == [True, False]
    assert with_reach_margin(ur5, q[:0]).shape == (0,)
    panda = load_robot("panda")  # redundant
    q = panda.limits.mean(axis=1)[None].copy()
    q[0, 3] = panda.limits[3, 1]
    assert with_reach_margin(panda, q).all()
