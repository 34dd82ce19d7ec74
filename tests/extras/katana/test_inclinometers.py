"""Joints found blind from inclinometers, and joint 1 from side pulls, on an independent generator's arm."""

from dataclasses import replace

import generator
import katanas
import numpy as np
import pytest
from laws import Effect, poses

from workbench import Dataset, Motion
from workbench.arm.statics.moments import joint_moments
from workbench.base.errors import DataError
from workbench.extras.katana.load_test.experiment import pulled_joint, tilting_of
from workbench.extras.katana.load_test.postures import FIRM, PairPurpose, plan_load_test, possible, side_loads

SEED = 20_001


@pytest.fixture(scope="module")
def plan():
    return plan_load_test(katanas.nominal_robot(), added_mass=3.0, rng=np.random.default_rng(SEED))


@pytest.fixture(scope="module")
def measured(plan):
    """An arm as made with Tables 4.3 and 4.4 in its joints 1 to 5, and the readings of a plan."""
    rng = np.random.default_rng(SEED)
    actual = generator.katana().perturbed(rng, katanas.LENGTH, katanas.ANGLE)
    hidden = tuple(
        Effect(name, (j,), (float(sizes[j]),), detail)
        for name, sizes, detail in (
            ("clearance-tilt", katanas.CLEARANCE, None),
            ("backlash", katanas.BACKLASH, "moment"),
            ("joint-compliance", katanas.COMPLIANCE, None),
        )
        for j in range(5)
    )
    return actual, hidden, katanas.inclined(actual, hidden, plan, rng)


@pytest.fixture(scope="module")
def found(plan, measured):
    return tilting_of(katanas.nominal_robot(), plan, measured[2], instrument=katanas.METER)


def check(value, std, wanted, within):
    assert value == pytest.approx(wanted, rel=within)
    assert abs(value - wanted) < 4.0 * std
    assert std < 0.5 * within * wanted


def test_clearance_and_backlash_within_5_percent_and_compliance_within_10(found):
    joints = {j.joint: j for j in found.joints}
    assert set(joints) == {0, *katanas.TILTING}
    for j in katanas.TILTING:
        check(joints[j].clearance, joints[j].clearance_std, katanas.CLEARANCE[j], 0.05)
        check(joints[j].backlash, joints[j].backlash_std, katanas.BACKLASH[j], 0.05)
        check(joints[j].compliance, joints[j].compliance_std, katanas.COMPLIANCE[j], 0.10)
    check(joints[0].clearance, joints[0].clearance_std, katanas.CLEARANCE[0], 0.05)
    assert np.isnan(joints[0].backlash)
    assert found.fit.variance_factor == pytest.approx(1.0, abs=0.2)


def test_joint_1_is_found_by_side_pulls_from_poses(found, measured):
    """0.01 mm and 0.0069° poses; all else is known from the inclinometers."""
    actual, hidden, _ = measured
    rng = np.random.default_rng(3)
    loads = side_loads(katanas.nominal_robot(), 0, rng=rng)
    q, wrench = (np.repeat(rows, 5, axis=0) for rows in (loads.q, loads.wrench))
    seen = poses(actual, hidden, replace(katanas.still(q), wrench=wrench))
    position = seen[:, :3, 3] + 1e-5 * rng.standard_normal((len(q), 3))
    turned = generator.rotation(1.2e-4 * rng.standard_normal((len(q), 3))) @ seen[:, :3, :3]
    sigma = np.tile([1e-5] * 3 + [1.2e-4] * 3, (len(q), 1))
    data = Dataset(q=q, row=np.arange(len(q)), position=position, rotation=turned, sigma=sigma, wrench=wrench)
    (joint,) = pulled_joint(katanas.nominal_robot(), found, loads, data).joints
    check(joint.backlash, joint.backlash_std, katanas.BACKLASH[0], 0.05)
    check(joint.compliance, joint.compliance_std, katanas.COMPLIANCE[0], 0.10)


def test_pairs_load_their_joint_as_they_say(plan):
    """By moments worked out anew for every posture."""
    robot = katanas.nominal_robot()
    assert plan.unturned == (0,)
    assert plan.joints == katanas.TILTING
    assert possible(robot, plan.q).all()
    low, high = robot.limits.T
    assert ((plan.q >= low) & (plan.q <= high)).all()
    for pair in plan.pairs:
        moments = joint_moments(robot, Motion(pair.q, payload=pair.added))
        about, across = moments.about[:, pair.joint], moments.across[:, pair.joint]
        moved = np.count_nonzero(np.abs(np.diff(pair.q, axis=0)) > 0)
        assert moved + np.count_nonzero(np.diff(pair.added)) == 1
        if pair.purpose is PairPurpose.CROSSWISE:
            assert across[0] @ across[1] < -0.8 * np.linalg.norm(across[0]) * np.linalg.norm(across[1])
            assert (np.linalg.norm(across, axis=1) > FIRM).all()
        elif pair.purpose is PairPurpose.REVERSAL:
            assert about.prod() < 0.0
            assert (np.abs(about) > FIRM).all()
        else:
            assert about.prod() > 0.0
            assert abs(about[1] - about[0]) > 1.0
    loaded = {pair.joint for pair in plan.pairs if np.diff(pair.added).any()}
    assert {3, 4} <= loaded <= {2, 3, 4}


def test_a_posture_below_the_table_or_folded_is_not_possible():
    robot = katanas.nominal_robot()
    straight = np.zeros(5)
    down = np.array([0.0, -0.5, -1.5, -1.0, 0.0])
    folded = np.array([0.0, 1.0, 2.1, 1.9, 0.0])
    assert possible(robot, np.stack([straight, down, folded])).tolist() == [True, False, False]


def test_what_cannot_be_loaded_is_refused():
    robot, rng = katanas.nominal_robot(), np.random.default_rng(0)
    narrow = replace(robot, joints=tuple(replace(j, limits=(0.1, 0.12)) for j in robot.joints))
    with pytest.raises(DataError, match="widen its limits"):
        plan_load_test(narrow, rng=rng)
