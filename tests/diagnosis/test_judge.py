"""The judge of diagnoses: an oracle is right and good, and each kind of mistake is called by its name."""

from types import SimpleNamespace

import numpy as np
import pytest
from arms import TUNING, make, robot_of
from calibration import bins, expected_error
from cases import Named, stated
from judge import judge

from workbench.arm.effects import EFFECTS

CAUSE = {"odds": 1e3, "confidence": "certain", "look_alikes": (), "sentence": ""}


def found(calibrated, *effects, outliers=(), verdict="explained", before=None):
    """A diagnosis that names these effects, each as a cause."""
    return SimpleNamespace(
        causes=tuple(SimpleNamespace(whole=effect, **CAUSE) for effect in effects),
        outliers=np.array(outliers, int),
        calibrated=calibrated,
        before_fit=SimpleNamespace(calibrated=before or calibrated),
        verdict=verdict,
    )


def oracle(case, *instead):
    """What somebody would say who made the arm, or would name this instead."""
    effects = [stated(e) for e in case.hidden]
    actual = robot_of(case.actual, "actual", False).with_effects(*effects)
    return found(actual, *(instead or effects), outliers=case.misseated, before=case.robot)


@pytest.mark.parametrize("kind", ["none", "compliance-all", "harmonic-4", "two", "drift", "misseated-any"])
def test_who_knows_is_right(kind):
    case = make(kind, TUNING[11], "katana")
    judged = judge(case, lambda robot, data: oracle(case))
    assert (judged.right, judged.rows_right, judged.good) == (True, True, True)
    assert judged.error < 0.02


def test_who_says_nothing_is_not():
    case = make("misseated-any", TUNING[12])
    judged = judge(case, lambda robot, data: found(robot, verdict="no effect found"))
    assert (judged.missed, judged.extra) == (case.truth, ())
    assert judged.overlooked == len(case.misseated)
    assert (judged.right, judged.rows_right, judged.good) == (False, False, False)


def test_wrong_joints_orders_and_extra_effects_are_seen():
    case = make("harmonic-2", TUNING[13])
    joint, harmonic = case.hidden[0].joints[0], EFFECTS["joint-harmonic"]
    for order in (3, (2, 3)):
        judged = judge(case, lambda *_, order=order: oracle(case, harmonic((joint,), order=order)))
        assert judged.extra == (Named("joint-harmonic", (joint,), 3),)
        assert bool(judged.missed) is (order == 3)
        assert not judged.right
    elsewhere = oracle(case, harmonic(((joint + 1) % 6,), order=2))
    assert judge(case, lambda robot, data: elsewhere).missed == case.truth


def test_what_has_no_name_asks_for_a_better_model_and_for_no_claim():
    case = make("wobbling-mount", TUNING[14])
    assert not judge(case, lambda robot, data: found(robot)).right
    worse = case.actual.perturbed(np.random.default_rng(0), 1e-2, 1e-2)
    worse, bearing = robot_of(worse, "worse", False), EFFECTS["bearing-compliance"]((0,))
    judged = judge(case, lambda robot, data: found(robot, before=worse))
    assert (judged.right, judged.halved) == (True, True)
    assert judged.error < 0.5 * judged.before
    assert judge(case, lambda robot, data: found(robot, bearing, before=worse)).right
    more = (bearing, EFFECTS["backlash"]((1,)))
    judged = judge(case, lambda robot, data: found(robot, *more, before=worse))
    assert judged.extra == (Named("backlash", (1,), "moment"),)


def test_stated_odds_against_outcomes():
    """Ten claims at 96 %, eight of them true: off by 16 points; two at 60 %, one true: by 10."""
    odds = bins([(0.96, True)] * 8 + [(0.96, False)] * 2 + [(0.6, True), (0.6, False)])
    assert [(b.claims, b.true) for b in odds] == [(2, 1), (10, 8)]
    assert expected_error(odds) == pytest.approx((10 * 0.16 + 2 * 0.1) / 12)
    assert expected_error(bins([(1.0, True)])) == 0.0
