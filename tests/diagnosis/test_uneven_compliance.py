"""Joints that give way by laws that no catalogue holds."""

import pytest
from arms import make
from judge import judge
from slow import slow

from workbench.diagnosis.diagnose import diagnose


@pytest.mark.parametrize(
    ("kind", "seed", "arm"),
    [
        slow("belt-stretch", 9205, "three-parallel"),
        slow("belt-stretch", 9207, "aria"),
        ("hardening-drive", 9203, "industrial"),
    ],
)
def test_what_no_law_describes_is_predicted_and_not_named(kind, seed, arm):
    """They were harmonics, tilts and compliances of other joints, and left twice the error."""
    found = judge(make(kind, seed, arm), diagnose, held_out=0.0)
    assert found.clean, found.extra
    assert found.good
