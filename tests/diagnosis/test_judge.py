"""The judge of diagnoses: an oracle is right and good, and each kind of mistake is called by its name."""

from types import SimpleNamespace

import numpy as np
import pytest
from arms import TUNING, make, robot_of
from calibration import bins, expected_error
from cases import Named, stated
from claims import named
from judge import judge

from workbench.arm.effects import EFFECTS


@pytest.fixture
def oracle():
    """What somebody would say who made the arm."""

    def of(case):
        effects = [stated(e) for e in case.hidden]
        return SimpleNamespace(
            effects=tuple(SimpleNamespace(effect=e) for e in effects),
            outliers=np.array(case.misseated, int),
            calibrated=robot_of(case.actual, "actual", False).with_effects(*effects),
            before_fit=SimpleNamespace(calibrated=case.robot),
            verdict="explained",
        )

    return of


CAUSE = {"odds": 1e3, "confidence": "certain", "look_alikes": (), "contribution_mm": 0.1, "sentence": ""}


def cause(*effects, **said):
    """A cause as a diagnosis lists it."""
    joints = tuple(j for e in effects for j in e.joints)
    return SimpleNamespace(kind=effects[0].name, joints=joints, effects=effects, **CAUSE | said)


def names(*effects):
    return tuple(n for e in effects for n in named(e))


@pytest.mark.parametrize("kind", ["none", "compliance-all", "harmonic-4", "two", "drift", "misseated-any"])
def test_who_knows_is_right(kind, oracle):
    case = make(kind, TUNING[11], "katana")
    found = judge(case, lambda robot, data: oracle(case))
    assert found.right
    assert found.rows_right
    assert found.good
    assert found.error < 0.02


def test_who_says_nothing_is_not(oracle):
    case = make("misseated-any", TUNING[12])
    silent = SimpleNamespace(effects=(), outliers=(), calibrated=case.robot, verdict="no effect found")
    found = judge(case, lambda robot, data: silent)
    assert (found.missed, found.extra) == (case.truth, ())
    assert found.overlooked == len(case.misseated)
    assert (found.right, found.rows_right, found.good) == (False, False, False)


def test_wrong_joints_orders_and_extra_effects_are_seen(oracle):
    case = make("harmonic-2", TUNING[13])
    joint = case.hidden[0].joints[0]
    for order, extra in ((3, ((joint,), 3)), ((2, 3), ((joint,), 3))):
        result = oracle(case)
        result.effects = (SimpleNamespace(effect=EFFECTS["joint-harmonic"]((joint,), order=order)),)
        found = judge(case, lambda robot, data, result=result: result)
        assert found.extra == (Named("joint-harmonic", *extra),)
        assert bool(found.missed) is (order == 3)
        assert not found.right
    result.effects = (SimpleNamespace(effect=EFFECTS["joint-harmonic"](((joint + 1) % 6,), order=2)),)
    assert judge(case, lambda robot, data: result).missed == case.truth


def test_what_has_no_name_asks_for_a_better_model_and_for_no_claim(oracle):
    case = make("wobbling-mount", TUNING[14])
    result = SimpleNamespace(
        effects=(), outliers=(), calibrated=case.robot, verdict="unexplained", before_fit=SimpleNamespace()
    )
    result.before_fit.calibrated = case.robot
    assert not judge(case, lambda robot, data: result).right
    worse = case.actual.perturbed(np.random.default_rng(0), 1e-2, 1e-2)
    result.before_fit.calibrated = robot_of(worse, "worse", False)
    found = judge(case, lambda robot, data: result)
    assert found.right
    assert found.halved
    assert found.error < 0.5 * found.before
    result.effects = (SimpleNamespace(effect=EFFECTS["bearing-compliance"]((0,))),)
    assert judge(case, lambda robot, data: result).right
    result.effects += (SimpleNamespace(effect=EFFECTS["backlash"]((1,))),)
    assert judge(case, lambda robot, data: result).extra == (Named("backlash", (1,), "moment"),)


def test_stated_odds_against_outcomes():
    """Ten claims at 96 %, eight of them true: off by 16 points; two at 60 %, one true: by 10."""
    found = bins([(0.96, True)] * 8 + [(0.96, False)] * 2 + [(0.6, True), (0.6, False)])
    assert [(b.claims, b.true) for b in found] == [(2, 1), (10, 8)]
    assert expected_error(found) == pytest.approx((10 * 0.16 + 2 * 0.1) / 12)
    assert expected_error(bins([(1.0, True)])) == 0.0
