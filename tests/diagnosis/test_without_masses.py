"""Arms whose masses nobody knows: the soft joint is found from measured torques, or from products alone."""

from dataclasses import replace

import numpy as np
import pytest
from arms import TUNING, make
from laws import straight_moments

from workbench.arm.effects.gravity_sag import GravitySag
from workbench.arm.motion import Motion
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.next_poses import expected_torques
from workbench.diagnosis.search.candidates import catalogue

TORQUE_NOISE = 0.05
"""Of measured joint torques [N m]."""
CASES = [("aria", TUNING[2]), ("three-parallel", TUNING[1]), ("katana", TUNING[3])]


HARMONICS = [("aria", 0), ("three-parallel", 5)]


def massless(robot):
    return replace(robot, joints=tuple(replace(j, mass=None) for j in robot.joints))


def with_torques(case):
    """The rows with the moments about the axes, as sensors in the joints would read them."""
    moments = straight_moments(case.actual, case.state)[:, :, 2]
    noise = np.random.default_rng(case.seed).normal(0.0, TORQUE_NOISE, moments.shape)
    return replace(case.data, torque=moments + noise)


@pytest.mark.parametrize(("arm", "seed"), CASES)
@pytest.mark.parametrize("measured", [True, False])
def test_the_soft_joint_is_named(arm, seed, measured):
    case = make("compliance", seed, arm)
    found = diagnose(massless(case.robot), with_torques(case) if measured else case.data)
    name = "joint-compliance" if measured else "gravity-sag"
    assert [(e.effect.name, e.effect.joints) for e in found.effects] == [(name, case.truth[0].joints)]
    before, after = (v.held_out.position_mm.mean for v in (found.before, found.after))
    assert after < 0.5 * before
    assert len(found.measure_next) == 5
    if measured:
        (size,), (std,) = found.effects[0].effect.coefficients, found.effects[0].std
        assert abs(size - case.hidden[0].size[0]) < 5.0 * std + 0.02 * size


@pytest.mark.parametrize(("arm", "seed"), CASES[:2])
def test_what_stands_for_untried_loads_is_never_certain(arm, seed):
    """The soft bearing of a Katana without masses was a joint that certainly deflects."""
    case = make("compliance", seed, arm)
    (cause,) = diagnose(massless(case.robot), case.data, held_out=0.0).causes
    assert (cause.kind, cause.confidence) == ("gravity-sag", Confidence.PROBABLE)


def test_a_varying_payload_weighs_the_compliance():
    """What the payload adds is known, and with it the compliance itself."""
    case = make("payload", TUNING[1], "aria")
    (found,) = diagnose(massless(case.robot), case.data).effects
    assert (found.effect.name, found.effect.joints) == ("gravity-sag", case.truth[0].joints)
    last = found.effect.coefficients[-1] / 9.81
    assert abs(last - case.hidden[0].size[0]) < 5.0 * found.std[-1] / 9.81


@pytest.mark.parametrize(("arm", "seed"), HARMONICS)
def test_an_error_once_per_turn_of_a_level_axis_may_be_weight(arm, seed):
    """The sag by the next link alone is one sine of its angle, too: neither is named."""
    case = make("harmonic-1", seed, arm)
    found = diagnose(massless(case.robot), case.data, held_out=0.0)
    (cause,) = (c for c in found.causes if c.joints == case.hidden[0].joints)
    assert cause.confidence is Confidence.OPEN
    assert {cause.kind, *(e.name for e in cause.look_alikes)} >= {"joint-harmonic", "gravity-sag"}


def test_nothing_is_claimed_of_a_stiff_arm():
    case = make("none", TUNING[11], "aria")
    found = diagnose(massless(case.robot), case.data)
    assert found.effects == ()
    assert sum("gravity-sag was tried" in note for note in found.notes) == 1


@pytest.mark.parametrize("arm", [arm for arm, _ in CASES])
def test_torques_of_other_poses(arm):
    case = make("payload", TUNING[1], arm)
    half = len(case.data) // 2
    motion = Motion.of(with_torques(case))
    near, far = motion.take(slice(0, half)), motion.take(slice(half, None))
    expected = expected_torques(massless(case.robot), near, replace(far, torque=None))
    off = expected - straight_moments(case.actual, case.state)[half:, :, 2]
    assert np.sqrt((off**2).mean()) < 2.0 * TORQUE_NOISE


def test_what_is_offered():
    case = make("payload", TUNING[1], "aria")
    robot, motion = massless(case.robot), Motion.of(case.data)

    def sags(robot, motion):
        effects = (c.effect for c in catalogue(robot, motion).candidates)
        return {e.joints[0]: e for e in effects if isinstance(e, GravitySag) and e.terms.split()[2:]}

    assert sags(case.robot, motion) == {}
    assert set(sags(robot, motion)) == set(range(6))
    assert sags(robot, motion)[5].terms == "6x 6y payload"
    assert sags(robot, replace(motion, payload=None))[4].terms == "5x 5y 6x 6y"
    aslant = robot.under(np.array([3.0, 0.0, -4.0]))
    assert sags(aslant, motion)[0].gravity == (0.6, 0.0, -0.8)
    assert sags(robot.under(np.zeros(3)), motion) == {}
    gaps = np.zeros_like(motion.q)
    assert sags(robot, replace(motion, torque=gaps)) == {}
    gaps[3, 1] = np.nan
    assert set(sags(robot, replace(motion, torque=gaps))) == set(range(6))
