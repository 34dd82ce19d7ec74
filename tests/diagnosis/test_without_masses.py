"""Arms whose masses nobody knows: the soft joint is found from measured torques, or from products alone."""

from dataclasses import replace

import numpy as np
import pytest
from arms import TUNING, make
from laws import straight_moments
from slow import slow

from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.diagnose import diagnose

TORQUE_NOISE = 0.05
"""Of measured joint torques [N m]."""
CASES = [("aria", TUNING[2]), ("three-parallel", TUNING[1]), ("katana", TUNING[3])]


def massless(robot):
    return replace(robot, joints=tuple(replace(j, mass=None) for j in robot.joints))


@pytest.mark.parametrize(("arm", "seed"), [CASES[0], *(slow(*case) for case in CASES[1:])])
@pytest.mark.parametrize("measured", [1.0, -1.0, 0.0], ids=["held", "loaded", "unmeasured"])
def test_the_soft_joint_is_named(arm, seed, measured):
    case = make("compliance", seed, arm)
    moments = straight_moments(case.actual, case.state)[:, :, 2]
    noise = np.random.default_rng(case.seed).normal(0.0, TORQUE_NOISE, moments.shape)
    data = replace(case.data, torque=measured * (moments + noise)) if measured else case.data
    found = diagnose(massless(case.robot), data)
    name = "joint-compliance" if measured else "gravity-sag"
    assert [(e.effect.name, e.effect.joints) for e in found.effects] == [(name, case.truth[0].joints)]
    before, after = (v.held_out.position_mm.mean for v in (found.before, found.after))
    assert after < 0.5 * before
    assert len(found.measure_next) == (0 if measured else 5)  # torques of other poses are unknown
    if measured:
        (size,), (std,) = found.effects[0].effect.coefficients, found.effects[0].std
        assert abs(size - case.hidden[0].size[0]) < 5.0 * std + 0.02 * size


@pytest.mark.parametrize(("arm", "seed"), [slow(*CASES[0]), CASES[1]])
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
