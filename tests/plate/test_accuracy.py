"""Predicted errors against sampled parameters, and their honest infinity."""

import numpy as np
import pytest

from workbench.arm.kinematics.forward import identification_jacobian
from workbench.arm.linearisation import linearise
from workbench.arm.motion import Motion
from workbench.base.types import frozen
from workbench.plate import predicted_error as accuracy
from workbench.plate.observability import INDICES, I
from workbench.plate.optimality_criterion import criterion_of
from workbench.plate.predicted_error import position_weight, predicted_error


@pytest.fixture(scope="module")
def q(aria):
    low, high = aria.search_limits.T
    return np.random.default_rng(4).uniform(low, high, (30, 6))


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
    assert np.allclose(lengths.mean(0), error.position_means, rtol=0.04)
    assert np.allclose(angles.mean(0), error.rotation_means, rtol=0.04)
    assert error.position_mean < error.position_rms
    assert error.rotation_mean < error.rotation_rms


def test_the_region_is_linearised_once_for_all_moves_of_a_drag(aria, q, monkeypatch):
    requested, weights = [], []
    monkeypatch.setattr(
        accuracy,
        "identification_jacobian",
        lambda *args: requested.append(1) or identification_jacobian(*args),
    )
    region = frozen(q[10:].copy())
    fresh = predicted_error(linearise(aria, q[:10]), aria, q[10:])
    for move in range(3):
        linearisation = linearise(aria, q[:10] + 0.01 * move)
        error = predicted_error(linearisation, aria, region)
        weights.append(position_weight(aria, region, linearisation.names))
        if not move:
            assert np.array_equal(error.position, fresh.position)
    assert len(requested) == 2  # for the fresh array, and once for the region that stays
    assert all(weight is weights[0] for weight in weights)
    assert np.array_equal(weights[0], position_weight(aria, q[10:], linearisation.names))


def test_trace_with_the_weight_is_the_mean_square(aria, q):
    linearisation = linearise(aria, q[:10])
    weight = position_weight(aria, q[10:], linearisation.names)
    error = predicted_error(linearisation, aria, q[10:])
    assert np.sqrt(np.trace(weight @ linearisation.covariance)) == pytest.approx(error.position_rms)
    criterion = criterion_of(I(position_weight(aria, q[10:], linearisation.names, linearisation.weights)), 10)
    gram = (linearisation.scaled.T @ linearisation.scaled)[None]
    assert criterion(gram)[0] == pytest.approx(error.position_rms, rel=1e-6)
    cost = criterion_of(INDICES["O4"], 10)(gram)[0]
    assert cost == pytest.approx(-INDICES["O4"].value(linearisation), rel=1e-6)


def test_an_open_combination_makes_the_error_infinite_only_where_it_matters(aria, q):
    few = predicted_error(linearise(aria, q[:3]), aria, q[10:])
    assert np.isinf(few.position).all()
    assert np.isinf(few.position_rms)
    # base yaw and joint 1 can't be told apart, but no pose of the tool needs to know
    names = (*aria.default_free, "base.yaw")
    known = predicted_error(linearise(aria, q[:10]), aria, q[10:])
    redundant = predicted_error(linearise(aria, q[:10], names=names), aria, q[10:])
    assert np.allclose(redundant.position, known.position, rtol=1e-6)


def test_error_grows_with_the_noise_and_falls_with_repetition(aria, q):
    once = predicted_error(linearise(aria, q[:10]), aria, q[10:])
    twice = predicted_error(linearise(aria, np.concatenate([q[:10]] * 2)), aria, q[10:])
    assert np.allclose(twice.position * np.sqrt(2.0), once.position)
