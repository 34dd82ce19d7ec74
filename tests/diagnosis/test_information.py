"""Poses to measure next tell more than random ones, and can be reached."""

import numpy as np
import pytest
from arms import ARMS, make
from problems import fitted, slopes

from workbench.arm.effects import JointCompliance, JointHarmonic
from workbench.data.dataset import Dataset
from workbench.diagnosis.next_poses import next_poses
from workbench.identification.problem import Problem

REQUESTED = (JointCompliance((1,)), JointHarmonic((1,), order=1))
COUNT = 5


def at(problem, q):
    """The geometric problem on other joint positions; what is measured there does not matter."""
    rows = len(q)
    data = Dataset(q=q, position=np.zeros((rows, 3)), rotation=np.broadcast_to(np.eye(3), (rows, 3, 3)))
    return Problem.build(problem.robot, data, noise=problem.noise)


def information(problems, effects):
    """Log determinant of what rows say of effects beside the geometry, by explicit columns."""
    requested = np.vstack([slopes(p, effects) for p in problems])
    geometry = np.vstack([p.evaluate(p.start).jacobian[: p.size] for p in problems])
    beside = requested - geometry @ np.linalg.lstsq(geometry, requested, rcond=None)[0]
    return np.linalg.slogdet(beside.T @ beside)[1]


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("seed", range(3))
def test_chosen_poses_say_more_than_random_ones(arm, seed):
    fit = fitted(make("none", seed, arm, poses=40))
    problem, rng = fit.problem, np.random.default_rng(seed)
    chosen, _ = next_poses(problem, fit.x, REQUESTED, rng=rng, count=COUNT)
    assert chosen.shape == (COUNT, problem.data.joints)
    now = information([problem], REQUESTED)
    gain = information([problem, at(problem, chosen)], REQUESTED) - now
    low, high = problem.data.q.min(0), problem.data.q.max(0)
    random = [
        information([problem, at(problem, rng.uniform(low, high, chosen.shape))], REQUESTED) - now
        for _ in range(10)
    ]
    assert min(random) > -1e-6
    assert gain > max(random)


@pytest.mark.parametrize("arm", ARMS)
def test_poses_stay_within_what_was_measured(arm):
    case = make("none", 6, arm)
    fit = fitted(case)
    found, _ = next_poses(fit.problem, fit.x, REQUESTED, rng=np.random.default_rng(0))
    q = case.data.q
    assert ((found >= q.min(0)) & (found <= q.max(0))).all()
    assert len(np.unique(found, axis=0)) == len(found)
    where, seen = case.actual.pose(found)[:, :3, 3], case.data.position
    margin = 0.11 * np.ptp(seen, axis=0)
    assert ((where > seen.min(0) - margin) & (where < seen.max(0) + margin)).all()
