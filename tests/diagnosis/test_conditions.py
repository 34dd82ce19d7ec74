"""The conditions change what the program is told, and neither the arm nor what it hides."""

import numpy as np
import pytest
from arms import TUNING, make
from conditions import CONDITIONS, under
from laws import poses

KIND, SEED = "compliance", TUNING[1]


@pytest.fixture(scope="module")
def ideal():
    return make(KIND, SEED)


@pytest.mark.parametrize("name", CONDITIONS)
def test_the_hidden_arm_stays(ideal, name):
    given = CONDITIONS[name]
    case = under(given, KIND, SEED)
    same = make(KIND, SEED, free_frames=True) if given.free else ideal
    assert case.hidden == same.hidden
    assert case.seen == (given.noise == 1.0)  # three times the noise is too much for this one
    np.testing.assert_array_equal(case.actual.table, same.actual.table)
    assert len(case.data) == given.poses
    assert (case.data.rotation is None) == given.point
    off = case.data.position - poses(case.actual, case.hidden, case.state)[:, :3, 3]
    assert np.median(np.abs(off)) == pytest.approx(
        0.6745 * given.sigma[0], rel=0.3
    )  # quartile of the normal law
    if given.stated is not None:
        assert np.median(case.data.sigma[:, 0]) == pytest.approx(given.stated * given.sigma[0], rel=0.3)
    masses = np.array([joint.mass for joint in case.robot.joints])
    wrong = np.abs(masses / case.actual.masses - 1.0).max()
    assert wrong <= given.masses + 1e-12
    assert (wrong > 0.0) == (given.masses > 0.0)
    noise = np.abs(case.data.q - case.state.q).max()
    assert (noise > 0.0) == (given.joint_noise > 0.0)


def test_grid_and_half_are_what_they_say():
    grid, half, full = (under(CONDITIONS[n], KIND, SEED).state.q for n in ("grid", "half", "ideal"))
    assert max(len(np.unique(np.round(q, 9))) for q in grid.T) <= 5
    assert (np.ptp(half, axis=0) < 0.75 * np.ptp(full, axis=0)).all()
