"""What is claimed has a size that matters; what only predicts is a map; effects of one kind are one claim."""

from dataclasses import replace

import pytest
from arms import make
from claims import claims
from slow import slow

from workbench import Noise, diagnose
from workbench.diagnosis.confidence import Confidence


def test_a_dent_is_a_map_and_no_cause():
    case = make("dent", 5)
    found = diagnose(case.robot, case.data, noise=Noise(*case.sigma))
    assert found.causes == ()
    assert found.verdict_text == "predicted, but no cause is named", "what is left is the noise"
    assert found.residual_map.joints == case.hidden[0].joints
    assert found.residual_map.after.position_mm.mean < 0.7 * found.residual_map.before.position_mm.mean
    assert "names no cause" in found.message


@pytest.mark.slow
def test_a_joint_that_scatters_alone_is_not_named_after_a_part_of_its_error():
    """A drive that winds up follows its joint's motion in part, as a scale or backlash would."""
    case = make("wind-up", 203)
    found = diagnose(case.robot, case.data, held_out=0.0)
    assert all(c.confidence is Confidence.OPEN for c in found.causes)
    assert "follows the way by which joint 3 came (certain)" in found.message


def test_a_soft_bearing_is_not_called_a_soft_link_for_the_masses_behind_it():
    """The link's flexure holds the bearing as a special case; both are asked with uncertain masses."""
    case = make("bearing", 302, "three-parallel")
    mounting = replace(case.robot.mounting, gravity_tolerance=1e-3)
    found = diagnose(replace(case.robot, mounting=mounting), case.data, held_out=0.0)
    (cause,) = found.causes
    assert (cause.kind, cause.joints) == ("bearing-compliance", case.truth[0].joints)
    assert cause.confidence in ("certain", "probable")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "seed", "arm"), [("backlash-moment", 402, "gantry"), ("two", 306, "scara")])
def test_what_geometry_takes_back_is_no_coupling(kind, seed, arm):
    """Play bends the geometry that is fitted first, and the slides' right angle comes back with it.

    Of upright axes two couplings by the slide are its tilt, which the harmonic's fit had turned aside.
    """
    case = make(kind, seed, arm)
    found = diagnose(case.robot, case.data, held_out=0.0)
    assert sorted((c.kind, c.joints) for c in found.causes) == sorted((t.name, t.joints) for t in case.truth)


def test_words_are_odds():
    words = {1e6: "certain", 1000.0: "certain", 999.0: "probable", 19.0: "cannot tell"}
    assert {odds: str(Confidence.of(odds)) for odds in words} == words


@pytest.mark.parametrize(
    ("kind", "seed", "arm"),
    [
        slow("clearance", 3001, "gantry"),  # together they were weighed without the masses that one alone had
        slow("clearance", 3013, "gantry"),  # parallel axes turned, a coupling took what they lost
        slow("bearing", 3004, "scara"),  # likewise, and nothing was found
        slow("compliance", 4, "aria"),
        ("two", 5110, "katana"),  # two orders of one joint: its map entered first and stayed
    ],
)
def test_nothing_but_the_truth_is_named(kind, seed, arm):
    case = make(kind, seed, arm)
    found = claims(diagnose(case.robot, case.data))
    assert {name for claim in found if claim.decided for name in claim.names} == set(case.truth)
