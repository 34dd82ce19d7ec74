"""Influence-based identification: the thesis's steps end where the closed form says, and arms are found."""

import numpy as np
import pytest
from checks import with_errors
from studies.katana_influence import ANGLE, LENGTH_DEVIATION, influence
from studies.katana_printed import CONSTANTS

from workbench import Dataset, Motion, Noise, tool_poses
from workbench.base.types import Outcome
from workbench.identification.algorithms.influence_based import RCOND, InfluenceBased, pose_weights
from workbench.identification.algorithms.ols import Ols
from workbench.identification.problem import Problem


def problem_of(katana, rows, *, seed=0, turned=False, noise=0.0):
    """Rows of an arm with hidden errors, and where it differs from nominal."""
    rng = np.random.default_rng(seed)
    turns = np.array([not n.endswith((".a", ".d")) for n in CONSTANTS])
    errors = rng.normal(size=len(CONSTANTS)) * np.where(turns, 1.5e-3, 1e-4)
    actual = with_errors(katana, errors, CONSTANTS)
    q = rng.uniform(*katana.search_limits.T, (rows, 5))
    poses = tool_poses(actual, Motion(q))
    data = Dataset(
        q=q,
        position=poses[:, :3, 3] + rng.normal(size=(rows, 3)) * noise,
        rotation=poses[:, :3, :3] if turned else None,
    )
    return actual, Problem.build(katana, data, free=CONSTANTS, noise=Noise(1e-5, 1e-4))


def missed(problem, actual, x):
    q = np.random.default_rng(99).uniform(*actual.search_limits.T, (200, 5))
    found = problem.robot_at(x)
    return np.linalg.norm(
        tool_poses(found, Motion(q))[:, :3, 3] - tool_poses(actual, Motion(q))[:, :3, 3], axis=1
    ).mean()


def small_steps(jacobian, residual, weights, *, factor=0.1, resolution=1e-12, limit=10_000):
    """The thesis's own steps at one pose, eqs. (3.7), (3.8); their limit is what `InfluenceBased` takes.

    `factor` is C, below one; `resolution` the length of ΔP at which the steps end, in its own unit.
    """
    answer, left = np.zeros(jacobian.shape[1]), residual.copy()
    inverse = np.linalg.pinv(jacobian, rcond=RCOND)
    for _ in range(limit):
        if np.linalg.norm(left) <= resolution:
            break
        step = weights * (factor * (inverse @ left))
        answer += step
        left -= jacobian @ step
    return answer


def test_weights_are_the_imposed_deviations(katana):
    _, problem = problem_of(katana, 30)
    columns = problem.evaluate(problem.start).jacobian.reshape(30, 3, 17)
    deviations = np.array([ANGLE if p.unit == "rad" else LENGTH_DEVIATION for p in problem.parameters])
    expected = influence(katana, Motion(problem.data.q), names=CONSTANTS).weights
    assert np.allclose(pose_weights(columns * deviations), expected, atol=2e-3)


def test_one_pose_is_explained_as_the_small_steps_explain_it(katana):
    """The first round of a problem of one pose, in degrees and millimetres."""
    _, problem = problem_of(katana, 1)
    at = problem.evaluate(problem.start)
    units = np.array([np.deg2rad(1.0) if p.unit == "rad" else 1e-3 for p in problem.parameters])
    deviations = np.array([ANGLE if p.unit == "rad" else LENGTH_DEVIATION for p in problem.parameters])
    k = pose_weights((at.jacobian * deviations)[None])[0]
    steps = small_steps(at.jacobian * units, at.residual, k)
    found = InfluenceBased(limit=1).search(problem)
    moved = (found.x - problem.start) / units
    assert np.allclose(moved, steps, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("weighted", [True, False])
@pytest.mark.parametrize("turned", [True, False])
def test_an_arm_is_found(katana, weighted, turned):
    """Without noise and with many poses the error falls at least fiftyfold; least squares finds it all."""
    actual, problem = problem_of(katana, 118, turned=turned)
    before = missed(problem, actual, problem.start)
    found = InfluenceBased(weighted=weighted).search(problem)
    assert found.outcome is Outcome.CONVERGED
    assert missed(problem, actual, found.x) < before / 50.0
    assert all(b < a for a, b in zip(found.history, found.history[1:], strict=False))
    assert missed(problem, actual, Ols().search(problem).x) < 1e-9
