"""The study of influence-based identification: repeatable, its intervals right."""

import numpy as np
import pytest

from studies.conftest import KATANA
from studies.influence_study import METHODS, TROUBLES, InfluenceStudy


@pytest.fixture
def study(katana):
    return katana.weights


@pytest.mark.slow
def test_arms_begin_like_the_thesis(study):
    """1.21 mm on average before calibration (Table 3.4)."""
    assert study.before.shape == (len(TROUBLES), KATANA["weighed"])
    assert 1.0 < 1e3 * study.before.mean() < 1.5


@pytest.mark.slow
def test_when_it_helps_and_when_not(study):
    influence = list(METHODS).index("influence (eqs. 3.7, 3.8)")
    assert [study.ratio(t, 0, influence).verdict for t in range(3)] == ["better", "better", "worse"]
    assert [study.ratio(t, -1, influence).verdict for t in (1, 2)] == ["worse", "worse"]
    assert abs(study.ratio(0, -1, influence).value - 1.0) < 0.05


def test_intervals_by_hand():
    """Two methods, four arms: log ratios ±ln 2 have mean 0 and standard error ln 2 / √3."""
    errors = np.ones((3, 4, 1, 3))
    errors[:, :, 0, 2] = [2.0, 0.5, 2.0, 0.5]
    ratio = InfluenceStudy(numbers=(6,), before=np.ones((3, 4)), errors=errors).ratio(0, 0, 2)
    assert np.isclose(ratio.value, 1.0)
    assert np.isclose(np.log(ratio.high), 1.96 * np.log(2.0) / np.sqrt(3.0))
    assert ratio.better == 0.5
    assert ratio.verdict == "no different"
