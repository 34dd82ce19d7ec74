"""Backlash whose flanks change within rows: a cost that leaps stalls a fit, one with some width doesn't."""

from dataclasses import replace

import numpy as np
import pytest

from workbench import Dataset, Motion, identify, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.effects.axes import own
from workbench.arm.statics.deflection import deflect
from workbench.base.types import Outcome
from workbench.diagnosis.search.candidates import catalogue

PLAY, SIGMA, ROWS = 2e-3, 1e-4, 80
BACKLASH = EFFECTS["backlash"]


@pytest.fixture(scope="module")
def loose(aria):
    """Rows of an arm with play in joint 3 and other constants, a part of them where its load changes sign."""
    rng = np.random.default_rng(7)
    q = rng.uniform(*aria.search_limits.T, (2000, 6))
    soft = aria.with_effects(EFFECTS["joint-compliance"]((2,)))
    load = np.abs(own(soft.chain, [2], deflect(soft, Motion(q)).wrenches)[:, 0])
    order = np.argsort(load)
    q = q[np.r_[order[:24], rng.choice(order[24:], ROWS - 24, replace=False)]]
    moved = {n: aria.chain.values[aria.chain.index[n]] + rng.normal(0, 2e-3) for n in aria.default_free}
    seen = tool_poses(aria.with_values(moved).with_effects(BACKLASH((2,), (PLAY,))), Motion(q))
    return Dataset(
        q=q, row=np.arange(ROWS), position=seen[:, :3, 3] + rng.normal(0, SIGMA, (ROWS, 3)), source="loose"
    )


def fitted(aria, effect, rows, **options):
    found = identify(
        aria.with_effects(effect), rows, algorithms=("opt2",), effects=effect.names, held_out=0.0, **options
    )
    return found.runs["opt2"].fit


def test_a_fit_of_play_converges_where_the_sign_of_the_load_stalled_it(aria, loose):
    (offered,) = (
        c.effect
        for c in catalogue(aria, Motion.of(loose)).candidates
        if c.effect.name == "backlash" and c.effect.by == "moment" and c.effect.joints == (2,)
    )
    assert offered.width > 0.0
    assert fitted(aria, replace(offered, width=0.0), loose, deviation=np.inf).outcome is Outcome.STALLED
    fit = fitted(aria, offered, loose)
    assert fit.outcome is Outcome.CONVERGED
    assert fit.x[fit.problem.names.index("joint3.backlash")] == pytest.approx(PLAY, rel=0.05)


def test_play_without_a_width_is_that_of_the_sign(aria):
    """What was saved earlier keeps its meaning; motion needs no width."""
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 6))
    hard, soft = BACKLASH((1,), (PLAY,)), BACKLASH((1,), (PLAY,), width=1e-9)
    poses = [tool_poses(aria.with_effects(e), Motion(q)) for e in (hard, soft)]
    np.testing.assert_allclose(*poses, atol=1e-12)
    motion = replace(Motion(q), direction=np.sign(q))
    offered = [c.effect for c in catalogue(aria, motion).candidates if c.effect.name == "backlash"]
    assert {e.width for e in offered if e.by == "motion"} == {0.0}
