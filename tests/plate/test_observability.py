"""Indices against hand-worked spectra, their gradients, their invariances, leaving measurements out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from workbench.arm.built_in_arms import load_robot
from workbench.arm.linearisation import Linearisation, linearise
from workbench.base.errors import OptionError
from workbench.plate.observability import INDICES, I, O, SetIndex, evaluate, index_named

SETS = tuple(name for name, index in INDICES.items() if isinstance(index, SetIndex))


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


def arm_set(number=10, seed=0) -> Linearisation:
    robot = load_robot("aria")
    low, high = robot.search_limits.T
    return linearise(robot, np.random.default_rng(seed).uniform(low, high, (number, 6)))


def test_hand_worked_values():
    # singular values 8 and 2; two measurements
    values = evaluate(of_matrix([[0.0, 2.0], [8.0, 0.0]]))
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
    assert np.allclose(INDICES["O"].contributions(linearisation), [-0.125, 0.125])


def test_o_uses_the_six_singular_values_of_a_pose():
    robot = load_robot("aria")
    q = np.random.default_rng(1).uniform(-1, 1, (3, 6))
    jacobians = linearise(robot, q).unwhitened.reshape(3, 6, 24)
    expected = [np.sqrt(e[0] / e[-1]) for e in (np.linalg.eigvalsh(j @ j.T) for j in jacobians)]
    assert np.allclose(INDICES["O"].per_pose(linearise(robot, q)), expected)


def test_o_does_not_change_when_joint_1_alone_turns():
    robot = load_robot("aria")
    q = np.tile(np.random.default_rng(1).uniform(-1, 1, 6), (5, 1))
    q[:, 0] = np.linspace(-3, 3, 5)
    values = INDICES["O"].per_pose(linearise(robot, q))
    assert np.ptp(values) < 1e-12
    assert linearise(robot, q).rank() == 6


@pytest.mark.parametrize("name", SETS)
def test_below_full_rank_a_set_is_worth_nothing(name):
    assert INDICES[name].value(arm_set(3)) == 0.0
    assert not INDICES[name].gradient(arm_set(3)).any()


@pytest.mark.parametrize("name", INDICES)
def test_row_order_changes_nothing(name):
    robot = load_robot("aria")
    low, high = robot.search_limits.T
    q = np.random.default_rng(5).uniform(low, high, (8, 6))
    index = INDICES[name]
    assert index.value(linearise(robot, q)) == pytest.approx(index.value(linearise(robot, q[::-1])), rel=1e-9)


@given(factor=st.floats(0.01, 100.0), seed=st.integers(0, 1000))
def test_scaling_of_all_rows(factor, seed):
    jacobian = np.random.default_rng(seed).normal(size=(6, 3))
    plain, scaled = evaluate(of_matrix(jacobian)), evaluate(of_matrix(factor * jacobian))
    assert scaled["O2"] == pytest.approx(plain["O2"])
    for name in ("O1", "O3", "O4", "O5"):
        assert scaled[name] == pytest.approx(factor * plain[name])


@given(seed=st.integers(0, 1000))
def test_scaling_of_columns_multiplies_o1_by_a_constant(seed):
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.1, 10.0, 3)
    ratios = []
    for _ in range(2):
        jacobian = rng.normal(size=(6, 3))
        ratios.append(evaluate(of_matrix(jacobian * weights))["O1"] / evaluate(of_matrix(jacobian))["O1"])
    assert ratios[0] == pytest.approx(ratios[1])
    assert ratios[0] == pytest.approx(np.prod(weights) ** (1 / 3))


@given(seed=st.integers(0, 1000))
def test_added_measurements_never_lower_o3_and_o5(seed):
    jacobian = np.random.default_rng(seed).normal(size=(8, 3))
    few, more = evaluate(of_matrix(jacobian[:5])), evaluate(of_matrix(jacobian))
    assert more["O3"] >= few["O3"] * (1 - 1e-12)
    assert more["O5"] >= few["O5"] * (1 - 1e-12)


@pytest.mark.parametrize("name", SETS)
def test_the_same_poses_again(name):
    jacobian = np.random.default_rng(0).normal(size=(5, 3))
    once, twice = of_matrix(jacobian), of_matrix(np.tile(jacobian, (2, 1)))
    factor = {"O1": 1.0, "O2": 1.0, "D": 1.0}.get(name, np.sqrt(2.0))
    assert INDICES[name].value(twice) == pytest.approx(factor * INDICES[name].value(once))


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


@pytest.mark.parametrize("name", INDICES)
def test_contributions_against_leaving_out(name):
    linearisation = arm_set(8)
    index = INDICES[name]
    direct = [
        index.value(linearisation) - index.value(linearisation.without(i))
        for i in range(linearisation.measurements)
    ]
    assert np.allclose(index.contributions(linearisation), direct, rtol=1e-6, atol=1e-6 * max(direct))


def test_contributions_where_every_measurement_is_needed():
    linearisation = arm_set(4)
    for name in SETS:
        assert np.allclose(INDICES[name].contributions(linearisation), INDICES[name].value(linearisation))


def test_an_unknown_index_names_the_known_ones():
    with refuses(OptionError, "O1", option="index", found="O9"):
        index_named("O9")


def test_every_index_cites_its_source():
    assert all(index.source and index.meaning for index in INDICES.values())
    assert list(INDICES) == ["O", "O1", "O2", "O3", "O4", "O5", "A", "D"]


def test_i_is_one_over_the_predicted_error():
    """1/√trace(W C) by hand, its gradient by differences, and what is lost without each measurement."""
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
    assert np.allclose(index.contributions(made(jacobian)), index.value(made(jacobian)) - np.array(rest))
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
