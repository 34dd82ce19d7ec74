"""Whitening, scaling, rank and covariance of a linearisation."""

import numpy as np
import pytest
from checks import any_joints

from workbench import Motion, identification_jacobian
from workbench.arm.linearisation import Linearisation, linearise


@pytest.fixture
def q(aria):
    return any_joints(aria, 10, seed=3)


def of_matrix(jacobian, *, rows=1, sigma=1.0, units=None, length=1.0) -> Linearisation:
    jacobian = np.array(jacobian, float)
    m, p = jacobian.shape
    return Linearisation(
        jacobian=jacobian,
        names=tuple(f"p{i}" for i in range(p)),
        units=("m",) * p if units is None else units,
        sigma=np.full(m, sigma),
        measurement=np.arange(m) // rows,
        length=length,
    )


def test_an_angle_counts_as_the_arc_at_the_characteristic_length():
    linearisation = of_matrix([[3.0, 0.0], [0.0, 8.0]], units=("m", "rad"), length=2.0)
    assert np.allclose(linearisation.scaled, [[3.0, 0.0], [0.0, 4.0]])
    assert np.allclose(linearisation.singular_values, [4.0, 3.0])
    assert linearisation.condition == pytest.approx(4.0 / 3.0)
    assert np.allclose(linearisation.covariance, np.diag([1 / 9, 1 / 64]))


def test_covariance_and_rank_below_full_rank():
    linearisation = of_matrix([[1.0, 2.0], [2.0, 4.0]], units=("m", "rad"))
    assert linearisation.rank() == 1
    assert linearisation.condition == np.inf
    assert np.allclose(np.abs(linearisation.unidentifiable.T @ [1.0, 2.0]), 0.0, atol=1e-12)
    # pseudo-inverse of JᵀJ = 5 [1 2]ᵀ[1 2]: [1 2]ᵀ[1 2] / (5·25)
    assert np.allclose(linearisation.covariance, np.outer([1.0, 2.0], [1.0, 2.0]) / 125.0)


def test_rows_are_divided_by_their_deviations(aria, q):
    found = linearise(aria, q)
    twists = identification_jacobian(aria, Motion(q))[1]
    np.testing.assert_allclose(
        found.jacobian, (twists / np.repeat([1e-4, np.deg2rad(0.02)], 3)[:, None]).reshape(60, 24)
    )
    np.testing.assert_allclose(found.unwhitened, twists.reshape(60, 24))
    assert (found.names, found.measurements) == (aria.default_free, 10)
