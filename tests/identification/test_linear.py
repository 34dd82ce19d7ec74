"""The shared factorisation: steps, rank, what is not seen, and the words for it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.arm.confounded_constants import combinations
from workbench.arm.parameters import Parameter
from workbench.identification.algorithms.identifier import gauge_step
from workbench.identification.prior import Prior
from workbench.identification.undetermined_combinations import factorise


def full(rng, rows=30, columns=5):
    return rng.normal(size=(rows, columns)) * 10.0 ** rng.uniform(2, 4, columns), rng.normal(size=rows)


@given(st.integers(0, 2**32 - 1))
def test_step_is_the_least_squares_solution(seed):
    jacobian, residual = full(np.random.default_rng(seed))
    expected = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
    factor = factorise([(residual, jacobian)], np.ones(5))
    np.testing.assert_allclose(factor.step(), expected, rtol=1e-9, atol=1e-15)
    left = residual - jacobian @ expected
    decrease = residual @ residual - left @ left
    assert factor.predicted_decrease() == pytest.approx(decrease, rel=1e-9)
    np.testing.assert_allclose(factor.covariance(), np.linalg.inv(jacobian.T @ jacobian), rtol=1e-7)


@given(st.integers(0, 2**32 - 1), st.floats(1e-2, 1e6))
def test_damped_step_solves_the_damped_equations(seed, damping):
    jacobian, residual = full(np.random.default_rng(seed))
    factor = factorise([(residual, jacobian)], np.ones(5))
    normal = jacobian.T @ jacobian + damping * np.eye(5)
    assert factor.step(damping) == pytest.approx(np.linalg.solve(normal, jacobian.T @ residual), rel=1e-7)


def test_two_equal_columns_and_one_of_zeros_make_null_directions_in_one_order():
    rng = np.random.default_rng(0)
    jacobian, residual = full(rng)
    jacobian[:, 3], jacobian[:, 4] = jacobian[:, 1], 0.0
    factor = factorise([(residual, jacobian)], np.ones(5))
    assert factor.rank == 3
    np.testing.assert_allclose(factor.null_space.T @ [0, 1, 0, 1, 0], 0.0, atol=1e-9)
    names = ("joint1.d", "base.yaw", "joint2.a", "joint1.theta", "joint3.alpha")
    parameters = tuple(Parameter(n, "rad", 0.0) for n in names)
    for turn in np.linalg.qr(rng.normal(size=(9, 2, 2)))[0]:  # whatever the basis
        found = combinations(factor.null_space @ turn, parameters)
        assert [c.text for c in found] == ["base yaw with joint1.theta", "joint3.alpha (unobservable)"]


def test_covariance_is_that_of_least_squares_and_zero_along_what_is_not_seen():
    rng = np.random.default_rng(3)
    jacobian, residual = full(rng)
    jacobian[:, 4] = 0.0
    found = factorise([(residual, jacobian)], np.ones(5)).covariance()
    np.testing.assert_allclose(found[4], 0.0, atol=1e-20)
    four = np.linalg.inv(jacobian[:, :4].T @ jacobian[:, :4])
    np.testing.assert_allclose(found[:4, :4], four, rtol=1e-8, atol=1e-20)


def test_knowledge_of_some_constants_is_the_inverse_of_their_covariance():
    jacobian, _ = full(np.random.default_rng(4))
    names, information = tuple("abcde"), jacobian.T @ jacobian
    kept = Prior(names, np.zeros(5), information).keep(lambda name: name in "ace").information
    np.testing.assert_allclose(np.linalg.inv(kept), np.linalg.inv(information)[::2, ::2], rtol=1e-8)


@given(st.integers(0, 2**32 - 1))
def test_natural_units_make_limits_mean_the_same(seed):
    """A parameter counted in another unit is as well seen as before, and everything follows."""
    rng = np.random.default_rng(seed)
    jacobian, residual = full(rng)
    jacobian[:, 2] = 1e-3 * rng.normal(size=30)
    jacobian[:, 4] = jacobian[:, 0]
    units = 10.0 ** rng.uniform(-6, 3, 5)
    plain = factorise([(residual, jacobian)], np.ones(5))
    scaled = factorise([(residual, jacobian / units)], units)
    assert scaled.rank == plain.rank == 3
    np.testing.assert_allclose(scaled.svd.S, plain.svd.S, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(scaled.step() / units, plain.step(), rtol=1e-6, atol=1e-12)
    # both ways to the same matrix lose digits where a large unit meets a small one
    covariance = scaled.covariance() / np.outer(units, units)
    np.testing.assert_allclose(covariance, plain.covariance(), rtol=1e-6, atol=1e-12)
    null = scaled.null_space[:, 0]
    np.testing.assert_allclose(null / null[0], [1, 0, 0, 0, -1], atol=1e-6)
    step = gauge_step(scaled, np.zeros(5), units * np.array([1.0, 0.0, 0.0, 0.0, 3.0]))
    np.testing.assert_allclose(step / units, [1.0, 0.0, 0.0, 0.0, -1.0], atol=1e-6)
