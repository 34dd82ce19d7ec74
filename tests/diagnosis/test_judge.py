"""The judge of diagnoses: an oracle is right and good, and each kind of mistake is called by its name."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from arms import TUNING, make
from cases import Named, told
from counts import confusion, shares
from judge import judge, names

from workbench.arm.effects import EFFECTS
from workbench.arm.robot_toml import read_toml
from workbench.base.errors import DataError


@pytest.fixture
def oracle(tmp_path):
    """What somebody would say who made the arm."""

    def of(case):
        (tmp_path / "actual.toml").write_text(case.actual.toml())
        effects = [told(e) for e in case.hidden]
        return SimpleNamespace(
            effects=tuple(SimpleNamespace(effect=e) for e in effects),
            outliers=np.array(case.misseated, int),
            calibrated=read_toml(tmp_path / "actual.toml").with_effects(*effects),
            verdict="explained",
        )

    return of


@pytest.mark.parametrize("arm", ["aria", "katana"])
@pytest.mark.parametrize("kind", ["none", "compliance-all", "harmonic-4", "two", "drift", "misseated-any"])
def test_who_knows_is_right(kind, arm, oracle):
    case = make(kind, TUNING[11], arm)
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
        said = oracle(case)
        said.effects = (SimpleNamespace(effect=EFFECTS["joint-harmonic"]((joint,), order=order)),)
        found = judge(case, lambda robot, data, said=said: said)
        assert found.extra == (Named("joint-harmonic", *extra),)
        assert bool(found.missed) is (order == 3)
        assert not found.right
    said.effects = (SimpleNamespace(effect=EFFECTS["joint-harmonic"](((joint + 1) % 6,), order=2)),)
    assert judge(case, lambda robot, data: said).missed == case.truth


def test_effects_of_several_joints_are_counted_one_by_one():
    def records(*effects):
        return [SimpleNamespace(effect=e) for e in effects]

    both = names(records(EFFECTS["joint-compliance"]((1, 2)), EFFECTS["joint-coupling"]((3, 2))))
    assert both == (
        Named("joint-compliance", (1,)),
        Named("joint-compliance", (2,)),
        Named("joint-coupling", (3, 2)),
    )
    assert names(records(EFFECTS["backlash"]((0,), by="motion"), EFFECTS["base-drift"]())) == (
        Named("backlash", (0,), "motion"),
        Named("base-drift", ()),
    )


def test_small_compliances_may_be_named_or_not(oracle):
    case = make("compliance-all", TUNING[0], "aria")
    assert case.allowed
    said = oracle(case)
    said.effects = tuple(e for e in said.effects if names([e])[0] in case.truth)
    assert judge(case, lambda robot, data: said).right
    said.effects = said.effects[1:]
    assert not judge(case, lambda robot, data: said).right


def test_a_mount_is_the_first_joints_or_admitted(oracle):
    case = make("wobbling-mount", TUNING[14])
    said = SimpleNamespace(effects=(), outliers=(), calibrated=case.robot, verdict="unexplained")
    assert judge(case, lambda robot, data: said).right
    assert not judge(case, lambda robot, data: replace_verdict(said, "explained")).right
    said.effects = (SimpleNamespace(effect=EFFECTS["bearing-compliance"]((0,))),)
    assert judge(case, lambda robot, data: replace_verdict(said, "explained")).right
    said.effects += (SimpleNamespace(effect=EFFECTS["backlash"]((1,))),)
    assert not judge(case, lambda robot, data: said).right


def replace_verdict(said, verdict):
    return SimpleNamespace(**(vars(said) | {"verdict": verdict}))


def test_a_map_of_part_of_a_range_is_judged_within_it():
    case = make("dent", TUNING[15])
    joint = case.truth[0].joints[0]
    q = case.data.q[:, joint]
    local = EFFECTS["local-joint-error"]((joint,), knots=(float(q.min()), 0.0, float(q.max())))
    said = SimpleNamespace(
        effects=(SimpleNamespace(effect=local),),
        outliers=(),
        calibrated=case.robot.with_effects(local),
        verdict="explained",
    )
    found = judge(case, lambda robot, data: said)
    assert found.right
    assert np.isfinite(found.error)


def test_a_refusal_is_no_diagnosis():
    case = make("none", TUNING[16])

    def refuse(robot, data):
        raise DataError("too few rows")

    found = judge(case, refuse)
    assert found.failed
    assert (found.right, found.rows_right, found.good) == (False, False, False)


def test_the_tables_count(oracle):
    cases = [make("scale", s) for s in TUNING[20:23]]
    judged = [judge(c, lambda robot, data, c=c: oracle(c)) for c in cases]
    wrong = replace(judged[0], found=(Named("backlash", judged[0].found[0].joints, "moment"),))
    wrong = replace(wrong, missed=wrong.truth, extra=wrong.found)
    lines = [*judged[1:], wrong]
    matrix = confusion(lines)
    assert matrix["scale"]["encoder-scale"] == (2, 0)
    assert matrix["scale"]["backlash"] == (1, 0)
    share = shares(lines)["scale"]
    assert (share.cases, share.right, share.missed, share.extra) == (3, 2, 1, 1)
