"""Indices against hand-worked spectra, their gradients, their invariances."""

import numpy as np
import pytest
from checks import any_joints
from refusals import refuses

from tests.arm.test_linearisation import of_matrix
from workbench.arm.built_in_arms import load_robot
from workbench.arm.linearisation import Linearisation, linearise
from workbench.base.errors import OptionError
from workbench.plate.observability import INDICES, I, O, SetIndex, goal_index
from workbench.plate.predicted_error import rise_without_each

SETS = tuple(name for name, index in INDICES.items() if isinstance(index, SetIndex))


def arm_set(number=10, seed=0) -> Linearisation:
    robot = load_robot("aria")
    return linearise(robot, any_joints(robot, number, seed))


def test_hand_worked_values():
    # singular values 8 and 2; two measurements
    values = {name: index.value(of_matrix([[0.0, 2.0], [8.0, 0.0]])) for name, index in INDICES.items()}
    assert values["O1"] == pytest.approx(4.0 / np.sqrt(2.0))
    assert values["O2"] == pytest.approx(0.25)
    assert values["O3"] == pytest.approx(2.0)
    assert values["O4"] == pytest.approx(0.5)
    assert values["O5"] == pytest.approx(1.6)


def test_o_of_each_pose_is_unscaled():
    # whitened by 0.5, an angle in the second column: O sees neither
    jacobian = [[8.0, 0.0, 0.0], [0.0, 2.0, 0.0], [6.0, 0.0, 0.0], [0.0, 0.0, 3.0]]
    linearisation = of_matrix(jacobian, rows=2, sigma=0.5, units=("m", "rad", "m"), length=7.0)
    assert np.allclose(INDICES["O"].per_pose(linearisation), [0.25, 0.5])
    assert INDICES["O"].value(linearisation) == pytest.approx(0.375)


@pytest.mark.parametrize("name", SETS)
def test_below_full_rank_a_set_is_worth_nothing(name):
    assert INDICES[name].value(arm_set(3)) == 0.0
    assert not INDICES[name].gradient(arm_set(3)).any()


@pytest.mark.parametrize("name", INDICES)
def test_gradient_against_central_differences(name):
    rng = np.random.default_rng(2)
    units = ("m", "rad", "m", "rad")

    def value(jacobian):
        return INDICES[name].value(of_matrix(jacobian, rows=2, sigma=0.3, units=units, length=1.7))

    jacobian = rng.normal(size=(8, 4))
    gradient = INDICES[name].gradient(of_matrix(jacobian, rows=2, sigma=0.3, units=units, length=1.7))
    for _ in range(5):
        direction = rng.normal(size=jacobian.shape)
        step = 1e-6
        slope = (value(jacobian + step * direction) - value(jacobian - step * direction)) / (2 * step)
        assert slope == pytest.approx((gradient * direction).sum(), rel=1e-6)


def test_an_unknown_index_names_the_known_ones():
    with refuses(OptionError, "O1", option="index", found="O9"):
        goal_index("O9", None, None)


def test_i_is_one_over_the_predicted_error():
    """1/√trace(W C) by hand, its gradient by differences, and how the error rises without a measurement."""
    rng = np.random.default_rng(3)
    moves, units = rng.normal(size=(6, 4)), ("m", "rad", "m", "rad")
    index = I(moves.T @ moves)

    def made(jacobian):
        return of_matrix(jacobian, rows=2, sigma=0.3, units=units, length=1.7)

    jacobian, direction = rng.normal(size=(10, 4)), rng.normal(size=(10, 4))
    scaled = jacobian * [1.0, 1 / 1.7, 1.0, 1 / 1.7]
    square = np.trace(moves @ np.linalg.inv(scaled.T @ scaled) @ moves.T)
    assert index.value(made(jacobian)) == pytest.approx(square**-0.5)
    steps = [index.value(made(jacobian + h * direction)) for h in (1e-6, -1e-6)]
    slope = (index.gradient(made(jacobian)) * direction).sum()
    assert (steps[0] - steps[1]) / 2e-6 == pytest.approx(slope, rel=1e-6)
    rest = [index.value(made(np.delete(jacobian, [2 * k, 2 * k + 1], 0))) for k in range(5)]
    weight = index.weight / np.outer(made(jacobian).weights, made(jacobian).weights)
    rises = rise_without_each(made(jacobian), weight)
    assert np.allclose(rises, index.value(made(jacobian)) / np.array(rest) - 1.0)
    assert index.value(made(jacobian[:2])) == 0.0


def test_o_of_poses_and_points_together():
    """Rows of points are three, of poses six: each measurement is judged by its own."""
    whole = arm_set(4)
    keep = np.delete(np.arange(24), [9, 10, 11])
    mixed = Linearisation(
        jacobian=whole.jacobian[keep],
        names=whole.names,
        units=whole.units,
        sigma=whole.sigma[keep],
        measurement=whole.measurement[keep],
        length=whole.length,
    )
    expected = O().per_pose(whole)
    values = np.linalg.svd(whole.unwhitened[6:9], compute_uv=False)
    expected[1] = values[-1] / values[0]
    assert np.allclose(O().per_pose(mixed), expected)
    assert O().gradient(mixed).shape == mixed.jacobian.shape
