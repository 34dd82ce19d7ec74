"""Geometry and effects fitted together: without the large matrix the answer is the same."""

from dataclasses import replace

import numpy as np
import pytest
from arms import ARMS, make
from problems import fitted, geometric

from workbench import Motion, tool_poses
from workbench.arm.effects import BearingCompliance, Candidate, EncoderScale, JointCompliance, JointHarmonic
from workbench.diagnosis.search import refit as refits
from workbench.diagnosis.search.evidence import Term, left_by, offer
from workbench.diagnosis.search.gram_matrices import compress
from workbench.diagnosis.search.refit import linear_answer, refit, robot_with, with_own_noise
from workbench.identification.column_products import inner_products

BAND = JointHarmonic((1,), order=tuple(range(1, 9)))
FOLD = np.arange(120) % 5


@pytest.fixture(autouse=True)
def exact_masses(monkeypatch):
    """Masses are those of the file."""
    monkeypatch.setattr(refits, "needs_inertia", lambda robot: False)


def offered(case):
    """The fit of the geometry, inner products, and a model of a soft joint and a band of harmonics."""
    fit = fitted(case)
    candidates = (Candidate(JointCompliance(case.hidden[0].joints)), Candidate(BAND, np.eye(16)))
    grams = compress(fit.problem, fit.x, [c.effect for c in candidates], FOLD)
    model = ()
    for c in candidates:
        found = offer(left_by(grams, model), c)
        model = (*model, Term(c, 1.0) if found is None else found.term)
    return fit, grams, model


@pytest.mark.parametrize("arm", ARMS)
def test_chords_end_where_gauss_newton_ends(arm, monkeypatch):
    fit, grams, model = offered(make("compliance", 2, arm))
    begin = linear_answer(fit, grams, model)
    whole = refit(fit.problem, grams, model, starts=[begin])
    monkeypatch.setattr(refits, "large", lambda problem: True)
    pieces = refit(fit.problem, grams, model, starts=[begin])
    assert pieces.problem.names == whole.problem.names
    assert pieces.outcome.ok
    off = whole.problem.evaluate(whole.x).jacobian @ (pieces.x - whole.x)
    assert np.sqrt(off @ off / len(whole.x)) < 1e-3
    assert pieces.cost == pytest.approx(whole.cost, rel=1e-8)


def test_the_linear_solution_is_near_the_fit():
    """Its arm is within a tenth of the noise of the fitted one, on other rows."""
    case = make("compliance", 2)
    fit, grams, model = offered(case)
    linear = robot_with(fit, grams, model)
    found = refit(fit.problem, grams, model).calibrated
    seen = [tool_poses(a, Motion.of(case.exact))[:, :3, 3] for a in (linear, found)]
    bare = tool_poses(fit.calibrated, Motion.of(case.exact))[:, :3, 3]
    assert np.abs(seen[0] - seen[1]).max() < 0.1 * case.sigma[0]
    assert np.abs(bare - seen[1]).max() > 10 * case.sigma[0]


def test_shrunk_coefficients_are_held_by_their_variance():
    """The prior that joins the residuals is their common precision."""
    fit, grams, model = offered(make("compliance", 2))
    problem = refit(fit.problem, grams, model).problem
    names = list(BAND.names)
    columns = [problem.names.index(n) for n in names]
    held = problem.prior.T @ problem.prior
    expected = model[1].precision * np.eye(len(names))
    assert held[np.ix_(columns, columns)] == pytest.approx(expected, rel=1e-6, abs=1e-6 * model[1].precision)
    others = np.setdiff1d(np.arange(len(problem.names)), columns)
    assert not held[np.ix_(others, columns)].any()


def test_noise_is_what_the_fit_leaves():
    """Of twice the noise that the problem was whitened by; a fit of 24 constants has its freedom."""
    case = make("none", 4, noise=2.0)
    fit = fitted(case)
    left = with_own_noise(fit, geometric(case)).noise
    assert left.position == pytest.approx(case.sigma[0], rel=0.15)
    assert left.rotation == pytest.approx(case.sigma[1], rel=0.15)


def test_inner_products_need_no_jacobian():
    """Those of effects of one element and of several, of masses, of two sessions, and of the prior's rows."""
    problem = fitted(make("none", 2)).problem
    soft = (JointCompliance((1, 2)), BearingCompliance((2,)), JointHarmonic((3,), order=(1, 2)))
    robot = problem.robot.with_effects(*soft, EncoderScale((3,)))
    rows = replace(problem.data, session=np.resize(["a", "b", "b"], len(problem.data)))
    frames = replace(problem.frames, base=("x", "yaw"), base_per_session=True)
    names = tuple(robot.coefficients)
    wide = problem.again(robot=robot, data=rows, frames=frames, effects=names, inertia=True)
    x = wide.start + 1e-3 * wide.units * np.random.default_rng(0).normal(size=len(wide.names))
    at = wide.evaluate(x)
    table = np.column_stack([at.jacobian, at.residual])
    size = np.linalg.norm(table, axis=0)
    scale = np.outer(size, size)
    np.testing.assert_allclose(inner_products(wide, x) / scale, table.T @ table / scale, atol=1e-12)
