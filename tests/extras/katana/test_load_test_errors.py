"""Standard errors of a load test: against many draws of the readings at one plan of postures.

Errors of one test belong together: a clearance that is read too large at one joint is read too small at the
next, as both tip the links beyond. Their sum of squares over the joints of a few tests says little; weighted
with their covariance, and over many draws, it is what it must be.
"""

from dataclasses import replace

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.extras.katana.load_test import experiment
from workbench.extras.katana.load_test.joint_tilting_fit import KINDS
from workbench.identification.problem import Problem

DRAWS = [20, pytest.param(60, marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=DRAWS)
def drawn(request):
    """Errors of the clearances over draws, to first order about the fit, and their covariance."""
    robot = load_robot("katana450")
    test = experiment.run_load_test(robot, added_mass=3.0, seed=0)
    fit = test.tilting.fit
    problem, x = fit.problem, fit.x
    jacobian = problem.jacobian(x)
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    meter = replace(INSTRUMENTS["inclinometer"], samples=experiment.REPEATS)
    effects = [n for n in problem.names if n.split(".")[1] in KINDS]
    free = [p.name for p in problem.parameters if p.is_geometry]
    rng, errors = np.random.default_rng(3), []
    for _ in range(request.param):
        data = experiment.read_plan(fit.calibrated, test.plan, instrument=meter, rng=rng)
        message = experiment.with_other_masses(replace(problem.robot, joints=fit.calibrated.joints), rng)
        again = Problem.build(message, data, noise=problem.noise, free=free, effects=effects, inertia=True)
        errors.append(covariance @ (jacobian.T @ again.residual(x)))
    mine = [i for i, n in enumerate(problem.names) if n.endswith("clearance")]
    stated = np.array([j.clearance_std for j in test.tilting.joints])
    return np.array(errors)[:, mine], covariance[np.ix_(mine, mine)], stated


def test_standard_errors_of_clearances_are_those_of_many_draws(drawn):
    errors, covariance, stated = drawn
    draws = len(errors)
    assert np.allclose(stated, np.sqrt(np.diag(covariance)), rtol=0.02)
    seen = np.sqrt((errors**2).mean(axis=0)) / stated
    assert np.allclose(seen, 1.0, atol=4.0 / np.sqrt(2.0 * draws))
    squares = np.einsum("di,ij,dj->d", errors, np.linalg.inv(covariance), errors)
    assert squares.mean() == pytest.approx(5.0, abs=4.0 * np.sqrt(10.0 / draws))


def test_neighbours_err_against_each_other(drawn):
    """Why fifteen errors of three tests are not fifteen draws."""
    _, covariance, stated = drawn
    shared = covariance / np.outer(stated, stated)
    assert shared[1, 2] < -0.6
    assert shared[2, 3] < -0.4
