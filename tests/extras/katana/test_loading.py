"""The load test from end to end."""

import pytest

import workbench as wb


def test_the_experiment_from_end_to_end():
    found = wb.run_load_test("katana450", added_mass=3.0, each=2, seed=2)
    assert found.plan.unturned == (0,)
    assert [joint.joint for joint in found.joints] == [0, 1, 2, 3, 4]
    for joint, hidden in zip(found.joints, found.hidden, strict=True):
        for part, within in (("clearance", 0.05), ("backlash", 0.05), ("compliance", 0.15)):
            assert getattr(joint, part) == pytest.approx(getattr(hidden, part), rel=within)
    assert {str(pair.purpose) for pair in found.plan.pairs} == {"crosswise", "reversal", "size"}
    assert set(found.data.tilt) == {1, 2, 3, 4, 5}
