"""Events against what wanders from row to row, by hand and on arms that wind up, virtual and measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from real_arms import load
from scipy.stats import multivariate_normal

from workbench.diagnosis.claims.random_walk import START_VARIANCE, _likelihood
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.diagnose import diagnose

SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"


@pytest.mark.parametrize("q", [0.0, 0.3])
def test_the_filter_gives_the_density_of_a_walk(q):
    rng = np.random.default_rng(0)
    info, y = rng.uniform(0.5, 3.0, 12), rng.normal(size=12)
    walk = q * np.minimum.outer(np.arange(12), np.arange(12)) + START_VARIANCE
    dense = multivariate_normal(cov=walk + np.diag(1.0 / info)).logpdf(y)
    white = multivariate_normal(cov=np.diag(1.0 / info)).logpdf(np.zeros(12))
    assert _likelihood(y, info, q) == pytest.approx(dense - white, abs=1e-6)


@pytest.mark.data
@pytest.mark.data
def test_a_step_hidden_in_measured_rows_is_certain_though_other_events_are_doubted():
    """All events were dropped where one of them was doubtful."""
    robot, data = load(SHARED, "ur5")
    data = data.take(np.arange(200))
    q = np.array(data.q)
    q[100:, 2] -= 1e-3
    found = diagnose(robot, replace(data, q=q, direction=None), held_out=0.2)
    (zero,) = (c for c in found.causes if c.kind == "zero-step")
    assert zero.joints == (2,)
    assert abs(zero.row - 100) <= 2
    assert zero.confidence is Confidence.CERTAIN
