"""Virtual arms and measurements: what is hidden, how much noise there is, the same for the same seed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refuses

from workbench import Dataset, Frame, Motion, load_robot, tool_poses
from workbench.arm.inverse.solve import solve_many
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import simulate, simulate_targets, three_anchors, virtual_arm
from workbench.plate.simulated_measurement import without


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.fixture(scope="module")
def targets():
    angles = 2 * np.pi * np.arange(10) / 10
    places = np.stack([0.316 + 0.25 * np.cos(angles), 0.354 + 0.25 * np.sin(angles), np.full(10, 0.235)], -1)
    tilts = np.deg2rad(np.where(np.arange(10) % 2, -160.0, -150.0))
    turns = se3.rpy_to_matrix(np.stack([tilts, 0 * tilts, 0 * tilts], -1))
    return se3.pose(turns, places)


@settings(max_examples=10)
@given(seed=st.integers(0, 1000))
def test_hidden_errors_are_even_and_within_their_bounds(seed):
    aria = load_robot("aria")
    actual = virtual_arm(aria, rng=rng(seed))
    names = aria.default_free
    hidden = actual.values(names) - aria.values(names)
    turns = np.array([aria.chain.elements[aria.chain.index[n]].axis.turns for n in names])
    assert np.abs(hidden[turns]).max() <= np.deg2rad(0.3)
    assert np.abs(hidden[~turns]).max() <= 1e-3
    assert np.all(hidden != 0.0)
    assert np.array_equal(actual.limits, aria.limits)
    others = tuple(set(aria.chain.index) - set(names))
    assert np.array_equal(actual.values(others), aria.values(others))


def near(arm, targets):
    """Nominal joint positions far from the limits."""
    solved = solve_many(arm, arm.base.pose @ targets)
    return np.stack([max(one.within_limits, key=lambda branch: branch.margin).q for one in solved])


def test_noise_has_the_deviation_of_the_instrument(aria):
    q = rng().uniform(-0.9, 1.6, (4000, 6))
    instrument = INSTRUMENTS["tracker-6d"]
    data = simulate(aria, Motion(q), instrument=instrument, rng=rng(3))
    poses = tool_poses(aria, Motion(q))
    error = se3.pose_error(se3.pose(data.rotation, data.position), poses)
    assert np.allclose(error[:, :3].std(0), 5e-5, rtol=0.05)
    assert np.allclose(error[:, 3:].std(0), np.deg2rad(0.01), rtol=0.05)
    assert np.abs(error.mean(0)).max() < 5e-6
    assert np.allclose(data.sigma[0], [5e-5] * 3 + [np.deg2rad(0.01)] * 3)


def test_at_targets_the_actual_arm_is_there(aria, targets):
    actual = virtual_arm(aria, rng=rng(7))
    how = {"rng": rng(), "near": near(aria, targets)}
    data = simulate_targets(actual, targets, instrument=INSTRUMENTS["ideal"], **how)
    low, high = actual.limits.T
    assert np.allclose(tool_poses(actual, Motion(data.q)), targets, atol=1e-8)
    assert not np.allclose(tool_poses(aria, Motion(data.q)), targets, atol=1e-3)
    assert ((data.q >= low - 1e-9) & (data.q <= high + 1e-9)).all()
    assert np.allclose(se3.pose(data.rotation, data.position), targets, atol=1e-12)
    assert data.sigma is None


def test_targets_stand_in_the_base_of_the_robot(aria, targets):
    base = Frame(np.array([1.0, 2.0, 0.5]), np.diag([-1.0, -1.0, 1.0]))
    moved = aria.with_frames(base=base)
    how = {"instrument": INSTRUMENTS["ideal"], "near": near(aria, targets)}
    here, there = (simulate_targets(arm, targets, rng=rng(), **how) for arm in (aria, moved))
    assert np.allclose(here.q, there.q, atol=1e-7)
    assert np.allclose(there.position, here.position @ base.rotation.T + base.xyz, atol=1e-9)


def test_points_markers_distances_and_contacts(aria, targets):
    q = rng().uniform(-0.9, 1.6, (600, 6))
    poses = tool_poses(aria, Motion(q))
    point = simulate(aria, Motion(q), instrument=INSTRUMENTS["laser-tracker"], rng=rng())
    assert point.rotation is None
    assert np.isnan(point.sigma[:, 3:]).all()
    assert (point.position - poses[:, :3, 3]).std() == pytest.approx(2e-5, rel=0.05)
    seen = simulate(aria, Motion(q), instrument=INSTRUMENTS["motion-capture"], rng=rng())
    assert seen.markers.shape == (600, 4, 3)
    fits = np.stack([se3.best_fit(INSTRUMENTS["motion-capture"].markers, row) for row in seen.markers[:50]])
    assert np.linalg.norm(fits[:, :3, 3] - poses[:50, :3, 3], axis=1).mean() < 4e-4
    bar = simulate(aria, Motion(q), instrument=INSTRUMENTS["ball-bar"], rng=rng())
    direct = np.linalg.norm(poses[:, :3, 3] - [three_anchors(aria)[name] for name in bar.anchor], axis=1)
    assert (bar.distance - direct).std() == pytest.approx(5e-6, rel=0.1)
    assert bar.anchor[:4].tolist() == ["A", "B", "C", "A"]
    touched = np.concatenate([targets[:2], targets[1:2]])
    touched[2, :3, :3] = targets[0, :3, :3]
    how = {"rng": rng(), "near": near(aria, touched)}
    contact = simulate_targets(aria, touched, instrument=INSTRUMENTS["touch-probe"], **how)
    assert contact.contact.tolist() == ["point 1", "point 2", "point 2"]
    assert contact.position is None
    off = tool_poses(aria, Motion(contact.q))[:, :3, 3] - touched[:, :3, 3]
    assert 0.0 < np.abs(off).max() < 2e-4
    with refuses(OptionError, option="instrument", found="touch-probe"):
        simulate(aria, Motion(q), instrument=INSTRUMENTS["touch-probe"], rng=rng())


def test_rows_that_are_kept_out_stay_so_when_others_are_too():
    seen = Dataset(q=np.ones((3, 2)), position=np.ones((3, 3)))
    found = without(without(seen, np.array(["", "lost", ""])), np.array(["", "", "hits"]))
    assert found.reason.tolist() == ["", "lost", "hits"]
    assert (found.included == np.isfinite(found.position).all(1)).all()


def test_targets_out_of_reach_are_named(aria, targets):
    ideal, far = INSTRUMENTS["ideal"], targets.copy()
    far[:, 2, 3] += 5.0
    with refuses(DataError, target=0):
        simulate_targets(aria, far, instrument=ideal, rng=rng(), near=near(aria, targets))
