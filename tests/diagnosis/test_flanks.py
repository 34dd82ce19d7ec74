"""Play decided by load in several joints: the flanks are searched for, and the rest is an ordinary fit."""

from dataclasses import replace

import numpy as np
import pytest
import scipy
from arms import SIGMA, make, states
from conditions import CONDITIONS, under
from draws import draw, steady
from generator import rotation
from laws import poses
from problems import geometric
from slow import slow

from workbench import Motion, tool_poses
from workbench.arm.effects import EFFECTS, Candidate
from workbench.base.types import Outcome
from workbench.diagnosis.search.backlash_flanks import UNCERTAIN, Propagated
from workbench.diagnosis.search.candidates import catalogue
from workbench.diagnosis.search.evidence import Term
from workbench.diagnosis.search.refit import refit

LOOSE = {"aria": (1, 2, 3), "katana": (1, 2, 3), "three-parallel": (1, 2, 3, 4)}


def loose(arm, seed):
    """An arm whose joints have play, its rows, and the play by joint [rad]."""
    case = make("none", seed, arm)
    rng = np.random.default_rng([seed, 5])
    hidden = [draw("backlash", case.actual, case.state, rng, detail="moment", joint=j) for j in LOOSE[arm]]
    seen = poses(case.actual, hidden, case.state)
    seen[:, :3, 3] += SIGMA[0] * rng.standard_normal((len(seen), 3))
    seen[:, :3, :3] = rotation(SIGMA[1] * rng.standard_normal((len(seen), 3))) @ seen[:, :3, :3]
    case = replace(
        case, hidden=tuple(hidden), data=replace(case.data, position=seen[:, :3, 3], rotation=seen[:, :3, :3])
    )
    return case, {e.joints[0]: e.size[0] for e in hidden}


def fitted(case, joints):
    """Geometry and play fitted to the rows."""
    offered = catalogue(case.robot, Motion.of(case.data)).candidates
    model = tuple(
        Term(c) for c in offered if c.effect.flanked and c.effect.joints[0] in joints and not c.shrunk
    )
    assert len(model) == len(joints)
    return refit(geometric(case), None, model)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("arm", LOOSE)
def test_a_fit_of_several_plays_converges_to_them_within_its_errors(arm, seed):
    case, play = loose(arm, seed)
    fit = fitted(case, play)
    assert fit.outcome is Outcome.CONVERGED
    found, std = fit.problem.named(fit.x), fit.problem.named(fit.std)
    for joint, size in play.items():
        name = f"joint{joint + 1}.backlash"
        assert 3e-6 < std[name] < 5e-5
        assert abs(found[name] - size) < 4.0 * std[name]
    assert fit.variance_factor == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("arm", LOOSE)
def test_the_fitted_arm_is_good_where_no_play_hangs_between_its_flanks(arm):
    case, play = loose(arm, 3)
    fit = fitted(case, play)
    low, high = case.state.payload.min(), case.state.payload.max()
    fresh = states(case.actual, 150, np.random.default_rng(8), (low, high))
    fresh = fresh.take(np.flatnonzero(steady(case.actual, case.hidden, fresh)))
    truth = poses(case.actual, case.hidden, fresh)
    motion = Motion(fresh.q, payload=fresh.payload if case.data.payload is not None else None)
    found = tool_poses(fit.calibrated.in_session(""), motion)
    assert np.sqrt(((found - truth)[:, :3, 3] ** 2).mean()) < 0.5 * SIGMA[0]


@pytest.mark.parametrize(
    ("kind", "arm", "seed"), [slow("loose-5", "industrial", 3), ("loose-3", "katana", 17)]
)
def test_flanks_tell_of_masses_that_the_file_has_wrong(kind, arm, seed):
    """Centres are 10 mm off: in some rows a load has the other sign, but their poses show the flank."""
    case = under(CONDITIONS["masses10"], kind, seed, arm)
    play = {e.joints[0]: e.size[0] for e in case.hidden}
    fit = fitted(case, play)
    found, std = fit.problem.named(fit.x), fit.problem.named(fit.std)
    for joint, size in play.items():
        name = f"joint{joint + 1}.backlash"
        assert abs(found[name] - size) < 4.0 * std[name]
    assert fit.variance_factor == pytest.approx(1.0, abs=0.25)
    error = np.linalg.norm(
        tool_poses(fit.calibrated.in_session(""), Motion.of(case.exact))[:, :3, 3] - case.exact.position,
        axis=1,
    )
    assert np.quantile(error, 0.8) < 5.0 * SIGMA[0]  # the others hardly load the joint


def test_a_joint_without_load_tells_little_of_gravity():
    """Play of the upright axis beside a soft joint knew gravity's direction to a microradian."""
    case, _ = loose("aria", 3)
    leaning = replace(case.robot.mounting, gravity_tolerance=0.02)
    problem = geometric(replace(case, robot=replace(case.robot, mounting=leaning)))
    effects = EFFECTS["backlash"]((0,)), EFFECTS["joint-compliance"]((5,))
    fit = refit(problem, None, tuple(Term(Candidate(e)) for e in effects))
    assert fit.problem.named(fit.std)["gravity.x"] > UNCERTAIN * 0.02 / np.sqrt(len(case.data))


def test_a_normal_distribution_in_place_of_flanks_is_that_of_quadrature():
    """One mass, four rows: two sure of their flank, one contradicted by its load, one that tells nothing."""
    size, slope = np.array([1.0, -2.0, 0.5, 3.0]), np.array([[1.5], [1.0], [-1.0], [2.0]])
    right = np.array([0.999, 0.98, 0.01, 0.5])
    m = np.linspace(-8.0, 8.0, 20_001)
    side = scipy.stats.norm.cdf(size[:, None] + slope * m)
    weight = scipy.stats.norm.pdf(m) * np.prod(
        right[:, None] * side + (1.0 - right[:, None]) * (1.0 - side), axis=0
    )
    total = weight.sum() * (m[1] - m[0])
    mean = (weight * m).sum() / weight.sum()
    variance = (weight * (m - mean) ** 2).sum() / weight.sum()
    found = Propagated.of(size, slope, right)
    assert found.mean[0] == pytest.approx(mean, abs=0.03)
    assert found.spread[0, 0] == pytest.approx(variance, rel=0.1)
    assert found.evidence == pytest.approx(np.log(total), abs=0.05)
