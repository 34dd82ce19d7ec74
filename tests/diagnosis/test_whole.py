"""Whole diagnoses of virtual arms, on seeds for tuning; the full table is `tests/benchmarks/zoo.py`."""

from dataclasses import replace

import numpy as np
import pytest
from arms import ARMS, make
from judge import error_of, judge
from slow import slow

from workbench import Motion, diagnose, tool_poses
from workbench.diagnosis.result import Verdict

NAMED = ("compliance", "backlash-moment", "harmonic-3", "scale", "coupling", "drift", "thermal", "clearance")
WELL = 7
"""Of eight named kinds: one may go wrong by chance, as the table allows."""


def judged(kinds):
    """One seed a kind, over the three arms in turn."""
    return [judge(make(kind, k, list(ARMS)[k % 3]), diagnose, held_out=0.0) for k, kind in enumerate(kinds)]


@pytest.mark.slow
def test_named_effects_are_named():
    found = judged(NAMED)
    assert not any(j.failed for j in found), [j.verdict for j in found if j.failed]
    assert sum(j.right for j in found) >= WELL, [(j.kind, j.truth, j.found) for j in found if not j.right]
    assert sum(j.good for j in found) >= WELL


def test_nothing_is_found_where_nothing_is_hidden():
    for k, arm in enumerate(ARMS):
        case = make("none", k, arm)
        result = diagnose(case.robot, case.data, held_out=0.0)
        assert result.effects == ()
        assert result.verdict is Verdict.NO_EFFECT
        assert result.remaining.noise.position == pytest.approx(case.sigma[0], rel=0.15)
        assert error_of(result.calibrated, case) < 0.5


@pytest.mark.parametrize(
    ("kind", "seed", "arm"), [slow("misseated", 0, "aria"), ("misseated-any", 1, "three-parallel")]
)
def test_misplaced_rows_are_set_apart_beside_an_effect(kind, seed, arm):
    j = judge(make(kind, seed, arm), diagnose, held_out=0.0)
    assert j.rows_right, (j.kind, j.overlooked, j.accused)


def test_held_out_rows_choose_nothing():
    """Their measurements altered by a third of a millimetre: the same effects, the same coefficients."""
    case = make("compliance", 3)
    result = diagnose(case.robot, case.data, held_out=0.25)
    position = case.data.position.copy()
    rng = np.random.default_rng(0)
    position[result.held_out_rows] += 3e-4 * rng.standard_normal((len(result.held_out_rows), 3))
    other = diagnose(case.robot, replace(case.data, position=position), held_out=0.25)
    assert (other.held_out_rows == result.held_out_rows).all()
    assert [c.label for c in other.causes] == [c.label for c in result.causes]
    assert (other.after_fit.x == result.after_fit.x).all()
    assert (other.before_fit.x == result.before_fit.x).all()
    assert (other.measure_next == result.measure_next).all()
    assert other.after.held_out.position_mm.mean > 3 * result.after.held_out.position_mm.mean


@pytest.mark.slow
def test_a_soft_joint_is_found_with_base_and_tool_free():
    """Some 0.9 mm of compliance are left to 0.03 mm on rows without noise."""
    case = make("compliance-all", 1, "aria", free_frames=True)
    result = diagnose(case.robot, case.data)
    left = [
        1e3 * np.linalg.norm(_seen(arm, case.exact) - case.exact.position, axis=1).mean()
        for arm in (result.before_fit.calibrated, result.calibrated)
    ]
    assert left[1] <= 0.03 < 5 * left[1] < left[0]


def _seen(arm, rows):
    return tool_poses(arm, Motion.of(rows))[:, :3, 3]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "seed", "arm"),
    [
        ("belt-stretch", 9205, "three-parallel"),
        ("belt-stretch", 9207, "aria"),
        ("hardening-drive", 9203, "industrial"),
    ],
)
def test_what_no_law_describes_is_predicted_and_not_named(kind, seed, arm):
    """They were harmonics, tilts and compliances of other joints, and left twice the error."""
    found = judge(make(kind, seed, arm), diagnose, held_out=0.0)
    assert found.clean, found.extra
    assert found.good
