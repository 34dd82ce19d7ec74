"""Inclinometers: what they read, to a file and back, and what a fit makes of them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench import Frame, Motion, Noise, load_robot, read_measurements, write_measurements
from workbench.arm.effects import EFFECTS
from workbench.base import se3
from workbench.base.types import frozen
from workbench.data.observations.tilt import reading, seen_from, upward
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import simulate
from workbench.diagnosis.search.candidates import candidate_columns
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.fit import Fit
from workbench.identification.problem import Problem

turn = st.floats(-3.0, 3.0)


@given(x=turn, y=turn, z=turn, yaw=turn)
def test_a_reading_is_where_up_is_and_nothing_else(x, y, z, yaw):
    """There and back over the whole sphere; turning the link about the vertical changes nothing."""
    rotation = se3.rotvec_to_matrix(np.array([x, y, z]))
    up = rotation.T @ [0.0, 0.0, 1.0]
    np.testing.assert_allclose(seen_from(rotation), up, atol=1e-12)
    np.testing.assert_allclose(upward(reading(up)), up, atol=1e-9)
    about = se3.rotvec_to_matrix(np.array([0.0, 0.0, yaw]))
    np.testing.assert_allclose(seen_from(about @ rotation), up, atol=1e-12)


def test_by_hand_a_link_that_rolled_by_30_degrees():
    for turned in ([30.0, 0.0, 0.0], [0.0, -20.0, 0.0]):
        link = se3.rotvec_to_matrix(np.deg2rad(turned))
        np.testing.assert_allclose(np.rad2deg(reading(seen_from(link))), turned[:2], atol=1e-12)


def offsets(robot):
    """Joint offsets that an inclinometer can show: not that of the first joint, and all of the others."""
    return [f"joint{j + 1}.theta" for j in range(1, robot.dof)]


def test_joint_offsets_are_found_from_tilts_alone(tmp_path):
    """A UR5 on a slanted wall, from a file as it is written, in a place and with a tool that nobody knows."""
    rng = np.random.default_rng(0)
    gravity = se3.rotvec_to_matrix(np.array([0.4, -0.7, 0.0])) @ np.array([0.0, 0.0, -9.81])
    arm = load_robot("ur5").under(frozen(gravity))
    wrong = dict(zip(offsets(arm), rng.uniform(-0.02, 0.02, arm.dof - 1).tolist(), strict=True))
    actual = arm.with_values({n: v + arm.chain.values[arm.chain.index[n]] for n, v in wrong.items()})
    moved = Frame(frozen(np.array([1.0, 2.0, 3.0])), frozen(se3.rotvec_to_matrix(np.array([0.3, 0.2, 1.0]))))
    q = rng.uniform(-2.5, 2.5, (40, arm.dof))
    actual = actual.with_frames(base=moved)
    rows = simulate(actual, Motion(q), instrument=INSTRUMENTS["inclinometer"], rng=rng)
    data = read_measurements(write_measurements(rows, tmp_path / "tilts.csv"), joints=arm.dof)
    for link in rows.tilt:
        np.testing.assert_array_equal(data.tilt[link], rows.tilt[link])
    noise = Noise(rotation=np.deg2rad(0.001))
    problem = Problem.build(arm, data, noise=noise, free=offsets(arm))
    fit = Fit(algorithm=Opt2(), problem=problem, search=Opt2().search(problem))
    off = fit.x - actual.values(tuple(offsets(arm)))
    assert np.abs(off / fit.std).max() < 4.0
    assert fit.std.max() < 1e-5
    assert fit.variance_factor == pytest.approx(1.0, abs=0.25)


@pytest.fixture(scope="module")
def loose():
    """A Katana with a loose and soft joint 3, read on links 2 to 5 under loads."""
    robot = load_robot("katana450")
    effects = [EFFECTS["clearance-tilt"]((2,), (4e-4,)), EFFECTS["joint-compliance"]((1, 2), (1e-4, 2e-4))]
    rng = np.random.default_rng(2)
    motion = Motion(rng.uniform(-1.5, 1.5, (15, 5)), payload=rng.uniform(0.0, 3.0, 15))
    deflected = robot.with_effects(*effects)
    return (robot, deflected, simulate(deflected, motion, instrument=INSTRUMENTS["inclinometer"], rng=rng))


def test_the_derivative_through_a_bent_arm(loose):
    _, deflected, rows = loose
    problem = Problem.build(deflected, rows, effects=tuple(deflected.coefficients))
    x, unit = problem.start, 1e-6 * problem.units
    jacobian = problem.evaluate(x).jacobian
    for column, step in enumerate(np.diag(unit)):
        difference = (problem.residual(x - step) - problem.residual(x + step)) / (2.0 * unit[column])
        scale = max(np.abs(jacobian[:, column]).max(), 1.0)
        assert np.abs(difference - jacobian[:, column]).max() < 1e-5 * scale, problem.names[column]


def test_candidates_of_a_diagnosis_are_seen_from_the_links(loose):
    """Their columns are those of a model that carries them, to first order."""
    robot, deflected, rows = loose
    problem = Problem.build(robot, rows)
    wide = Problem.build(robot.with_effects(*(replace(e, coefficients=()) for e in deflected.effects)), rows,
                         effects=tuple(deflected.coefficients))  # fmt: skip
    whole = wide.evaluate(wide.start).jacobian[:, [wide.names.index(n) for n in deflected.coefficients]]
    parts = [part.table for _, part in candidate_columns(problem, problem.start, deflected.effects)]
    order = [n for e in deflected.effects for n in e.names]
    found = np.concatenate(parts)[:, [order.index(n) for n in deflected.coefficients]]
    np.testing.assert_allclose(found, whole, atol=1e-9 * np.abs(whole).max())
