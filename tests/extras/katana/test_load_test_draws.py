"""A load test's standard errors against what virtual arms hide: whole draws of arm, postures and readings."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refuses

from workbench import Motion, load_robot
from workbench.arm.statics.moments import joint_moments
from workbench.base.errors import DataError
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import virtual_arm
from workbench.extras.katana.load_test import experiment, tolerance
from workbench.extras.katana.load_test.joint_tilting_fit import KINDS
from workbench.extras.katana.load_test.postures import plan_load_test
from workbench.extras.katana.load_test.tolerance import ANGLE, LENGTH, constants_known, has_certain_load_sides

METER = replace(INSTRUMENTS["inclinometer"], samples=experiment.REPEATS)


@pytest.fixture(scope="module")
def planned():
    robot = load_robot("katana450").with_effects()
    return robot, plan_load_test(robot, added_mass=3.0, each=2, rng=np.random.default_rng(11))


def test_planned_loads_come_from_a_side_beyond_doubt(planned):
    robot, plan = planned
    about, across = has_certain_load_sides(robot, Motion(plan.q, payload=plan.added), constants_known(robot))
    assert about[:, 1:].all()
    assert across.all()


def test_moments_err_as_those_of_many_arms(planned):
    """Against arms drawn with the whole errors."""
    robot, plan = planned
    motion, rng = Motion(plan.q, payload=plan.added).take(slice(0, 8)), np.random.default_rng(0)
    arms = [
        experiment.with_other_masses(virtual_arm(robot, rng=rng, errors=(LENGTH, ANGLE)), rng)
        for _ in range(150)
    ]
    seen = np.std([joint_moments(arm, motion).about for arm in arms], axis=0)
    stated, _ = tolerance.moment_errors(robot, motion, constants_known(robot))
    np.testing.assert_allclose(stated[:, 1:], seen[:, 1:], rtol=0.25)


def test_a_fit_far_above_the_noise_is_refused_with_its_row(planned):
    robot, plan = planned
    data = experiment.read_plan(robot, plan, instrument=METER, rng=np.random.default_rng(1))
    tilt = {link: readings.copy() for link, readings in data.tilt.items()}
    tilt[4][7] += np.deg2rad(0.05)
    with refuses(DataError, row=7):
        experiment.tilting_of(robot, plan, replace(data, tilt=tilt), instrument=METER)


def test_heavier_links_are_found_beside_the_sizes(planned):
    """All links 10 % above the file: masses come out as they are, no size leaves its error."""
    robot, plan = planned
    hidden = experiment.draw_joints(experiment.observable_sizes(plan, ()), np.random.default_rng(4))
    joints = tuple(replace(j, mass=1.1 * j.mass if j.mass else j.mass) for j in robot.joints)
    actual = replace(robot, joints=joints).with_effects(*experiment.tilting_effects(hidden))
    data = experiment.read_plan(actual, plan, instrument=METER, rng=np.random.default_rng(5))
    fit = experiment.tilting_of(robot, plan, data, instrument=METER).fit
    true = {f"joint{j.joint + 1}.{word}": getattr(j, word) for j in hidden for word in KINDS}
    for name, value, std in zip(fit.problem.names, fit.x, fit.std, strict=True):
        if name in true or name.endswith("mass"):
            assert abs(value - true.get(name, actual.inertia.get(name))) < 4.0 * std, name
    assert fit.variance_factor < 1.5
