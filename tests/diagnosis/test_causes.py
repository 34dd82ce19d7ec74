"""What is claimed has a size that matters; what only predicts is a map; effects of one kind are one claim."""

import pytest
from arms import make
from claims import claims
from refusals import mentions

from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.remaining_error import CHECK_DRIVES


def test_a_dent_is_a_map_and_no_cause():
    case = make("dent", 5)
    found = diagnose(case.robot, case.data)
    assert found.causes == ()
    assert found.residual_map.joints == case.hidden[0].joints
    assert found.residual_map.after.position_mm.mean < 0.7 * found.residual_map.before.position_mm.mean
    assert "names no cause" in found.message


def test_a_joint_that_scatters_alone_is_not_named_after_a_part_of_its_error():
    """A drive that winds up follows its joint's motion in part, as a scale or backlash would."""
    case = make("wind-up", 203)
    found = diagnose(case.robot, case.data, held_out=0.0)
    assert found.causes == ()
    assert mentions(found.message, "joint 3")
    assert CHECK_DRIVES in found.message


@pytest.mark.parametrize(
    ("kind", "seed", "arm"),
    [
        ("bearing", 302, "three-parallel"),  # the link's flexure holds a bearing as a special case
        ("backlash-moment", 402, "gantry"),  # play bends the geometry that is fitted first
        ("two", 306, "scara"),  # two couplings by the slide are its tilt, which a harmonic's fit had turned
        ("clearance", 3001, "gantry"),  # joints together were weighed without the masses that one alone had
        ("clearance", 3013, "gantry"),  # parallel axes turned, a coupling took what they lost
        ("bearing", 3004, "scara"),  # likewise, and nothing was found
        ("two", 5110, "katana"),  # two orders of one joint: its map entered first and stayed
    ],
)
def test_nothing_but_the_truth_is_named(kind, seed, arm):
    case = make(kind, seed, arm)
    found = claims(diagnose(case.robot, case.data))
    assert {name for claim in found if claim.decided for name in claim.names} == set(case.truth)
