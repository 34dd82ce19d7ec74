"""The circle of chapter 5 drawn on paper by one virtual arm and read."""

import numpy as np
import pytest

from studies.finding import Verdict
from studies.katana_pencil import METHODS, pencil_finding, pencil_picture

pytestmark = pytest.mark.slow


@pytest.fixture
def found(katana):
    return katana.pencil


def test_what_is_read_is_what_the_arm_did(found):
    """Within a fraction of the pencil's width, whichever way it drew."""
    assert found.read.shape == found.actual.shape == (len(METHODS), len(found.time))
    assert np.abs(found.read - found.actual).mean(axis=1).max() < 0.06
    assert found.actual[2].mean() < found.actual[0].mean() / 3.0


def test_the_paper_tells_before_from_after(found):
    assert pencil_finding(found).verdict is Verdict.AGREES
    assert pencil_picture(found).content[:4] == b"\x89PNG"
