"""Play decided by load in several joints: the flanks are searched for, and the rest is an ordinary fit."""

from dataclasses import replace

import numpy as np
import pytest
from arms import SIGMA, make, states
from draws import draw, settled
from generator import rotation
from laws import poses
from problems import geometric

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.types import Outcome
from workbench.diagnosis.candidates import catalogue
from workbench.diagnosis.evidence import Term
from workbench.diagnosis.refit import refit

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
    return refit(geometric(case), None, model).fit


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
    fresh = fresh.take(np.flatnonzero(settled(case.actual, case.hidden, fresh)))
    truth = poses(case.actual, case.hidden, fresh)
    motion = Motion(fresh.q, payload=fresh.payload if case.data.payload is not None else None)
    found = tool_poses(fit.calibrated.in_session(""), motion)
    assert np.sqrt(((found - truth)[:, :3, 3] ** 2).mean()) < 0.5 * SIGMA[0]
