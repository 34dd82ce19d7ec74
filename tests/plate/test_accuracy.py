"""Predicted errors against sampled parameters, and their honest infinity."""

import numpy as np
import pytest
from checks import any_joints

from workbench import Motion, identification_jacobian
from workbench.arm.linearisation import linearise
from workbench.plate.observability import INDICES, I
from workbench.plate.predicted_error import position_weight, predicted_error


@pytest.fixture(scope="module")
def q(aria):
    return any_joints(aria, 30, seed=4)


def test_against_sampled_parameters(aria, q):
    linearisation = linearise(aria, q[:10])
    error = predicted_error(linearisation, aria, q[10:])
    rng = np.random.default_rng(0)
    sampled = rng.multivariate_normal(np.zeros(24), linearisation.covariance, 20000)
    _, twists = identification_jacobian(aria, Motion(q[10:]))
    moves = np.einsum("rij,sj->sri", twists, sampled)
    lengths, angles = np.linalg.norm(moves[..., :3], axis=2), np.linalg.norm(moves[..., 3:], axis=2)
    assert np.allclose(np.sqrt((lengths**2).mean(0)), error.position, rtol=0.03)
    assert np.allclose(np.sqrt((angles**2).mean(0)), error.rotation, rtol=0.03)
    alone = [predicted_error(linearisation, aria, one[None]) for one in q[10:]]
    assert np.allclose(lengths.mean(0), [each.position_mean for each in alone], rtol=0.04)
    assert np.allclose(angles.mean(0), [each.rotation_mean for each in alone], rtol=0.04)
    assert error.position_mean < error.position_rms
    assert error.rotation_mean < error.rotation_rms


def test_trace_with_the_weight_is_the_mean_square(aria, q):
    linearisation = linearise(aria, q[:10])
    error = predicted_error(linearisation, aria, q[10:])
    assert error.position_rms == pytest.approx(np.sqrt(np.mean(error.position**2)))
    index = I(position_weight(aria, q[10:], linearisation.names, linearisation.weights))
    gram = (linearisation.scaled.T @ linearisation.scaled)[None]
    assert 1.0 / index.of_grams(gram, 10)[0] == pytest.approx(error.position_rms, rel=1e-6)
    found = INDICES["O4"].of_grams(gram, 10)[0]
    assert found == pytest.approx(INDICES["O4"].value(linearisation), rel=1e-6)


def test_an_open_combination_makes_the_error_infinite_only_where_it_matters(aria, q):
    few = predicted_error(linearise(aria, q[:3]), aria, q[10:])
    assert np.isinf(few.position).all()
    assert np.isinf(few.position_rms)
    # base yaw and joint 1 can't be told apart, but no pose of the tool needs to know
    names = (*aria.default_free, "base.yaw")
    known = predicted_error(linearise(aria, q[:10]), aria, q[10:])
    redundant = predicted_error(linearise(aria, q[:10], names=names), aria, q[10:])
    assert np.allclose(redundant.position, known.position, rtol=1e-6)
