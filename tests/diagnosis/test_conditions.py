"""The conditions change what the program is told, and neither the arm nor what it hides."""

from itertools import cycle

import numpy as np
import pytest
from arms import TUNING, make
from conditions import CONDITIONS, Conditions, under
from laws import poses

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion

KIND, SEED = "compliance", TUNING[1]
OTHERS = ("seven", "scara", "gantry", "industrial")


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


@pytest.mark.parametrize(("name", "arm"), list(zip(CONDITIONS, cycle(OTHERS), strict=False)))
def test_every_condition_holds_on_other_morphologies(name, arm):
    given = CONDITIONS[name]
    case = under(given, "none", SEED, arm)
    limits = case.robot.limits + 5.0 * given.joint_noise * np.array([-1.0, 1.0])
    assert (case.data.q >= limits[:, 0]).all()
    assert (case.data.q <= limits[:, 1]).all()
    assert len(case.data) == given.poses
    seen = tool_poses(case.robot, Motion.of(case.data))[:, :3, 3]
    near = np.linalg.norm(seen - case.data.position, axis=1)  # errors of manufacture, unknown frames, noise
    assert 1e-5 < np.median(near) < (0.15 if given.free else 0.03)


def test_what_rows_cannot_show_is_said():
    """A harmonic shows in 40 rows, and not at three hundred times the noise; no effect asks for nothing."""
    assert under(CONDITIONS["few"], "harmonic-1", SEED).seen
    assert not under(Conditions(noise=300.0), "harmonic-1", SEED).seen
    assert under(Conditions(noise=300.0), "none", SEED).seen
