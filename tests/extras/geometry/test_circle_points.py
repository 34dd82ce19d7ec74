"""Circle-point analysis: axes of an actual arm from circles, against where its axes are by construction."""

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import link_frames, tool_poses
from workbench.arm.motion import Motion
from workbench.base.errors import DataError, OptionError
from workbench.data.dataset import Dataset
from workbench.data.simulation.instruments import INSTRUMENTS
from workbench.data.simulation.simulate import simulate, virtual_arm
from workbench.extras.geometry.circle_points import circle_axes
from workbench.plate.poses.circle_points import circle_poses, levers


@pytest.fixture(scope="module")
def katana():
    return load_robot("katana450")


@pytest.fixture(scope="module")
def poses(katana):
    return circle_poses(katana, 62, rng=np.random.default_rng(0))


def test_one_joint_at_a_time(katana, poses):
    assert len(poses) == 62
    moved = (np.ptp(block, axis=0) > 0.0 for block in np.split(poses, [13, 26, 38, 50]))
    assert np.array_equal(np.array(list(moved)), np.eye(5, dtype=bool))
    assert ((poses >= katana.limits[:, 0]) & (poses <= katana.limits[:, 1])).all()
    assert levers(katana, poses).max(axis=0).min() > 0.1


def test_levers_are_distances_from_the_axes(katana, poses):
    frames, tips = link_frames(katana, Motion(poses)), tool_poses(katana, Motion(poses))[:, :3, 3]
    for joint in range(5):
        axis, foot = frames[:, joint + 1, :3, 2], frames[:, joint + 1, :3, 3]
        expected = np.linalg.norm(np.cross(axis, tips - foot), axis=1)
        assert np.allclose(levers(katana, poses)[:, joint], expected, atol=1e-12)


def test_exact_circles_give_the_actual_axes(katana, poses):
    actual = virtual_arm(katana, rng=np.random.default_rng(1))
    rows = simulate(actual, Motion(poses), instrument=INSTRUMENTS["ideal"], rng=np.random.default_rng(0))
    for axis in circle_axes(actual, rows):
        assert axis.angle < 1e-9
        assert axis.distance < 1e-9
        assert axis.rms < 1e-12
        lever = levers(actual, rows.q[axis.rows])[:, axis.joint]
        assert np.allclose(lever, axis.radius, atol=1e-9)


def test_an_arms_errors_show_in_its_axes(katana, poses):
    """An arm whose second axis leans by 1 mrad: so does joint 2's circle, with a laser tracker's noise."""
    actual = katana.with_values({"joint2.alpha": katana.values(("joint2.alpha",))[0] + 1e-3})
    rows = simulate(
        actual, Motion(poses), instrument=INSTRUMENTS["laser-tracker"], rng=np.random.default_rng(3)
    )
    found = {axis.joint: axis for axis in circle_axes(katana, rows)}
    assert set(found) == {0, 1, 2, 3, 4}
    assert found[0].angle < 2e-4
    assert np.isclose(found[1].angle, 1e-3, atol=2e-4)
    assert all(axis.rms < 5e-5 for axis in found.values())


def test_what_is_no_circle(katana):
    q = np.random.default_rng(0).uniform(*katana.search_limits.T, (40, 5))
    rows = Dataset(q=q, row=np.arange(40), position=tool_poses(katana, Motion(q))[:, :3, 3])
    with pytest.raises(DataError) as error:
        circle_axes(katana, rows)
    assert "moved alone" in str(error.value)
    with pytest.raises(OptionError):
        circle_poses(katana, 24, rng=np.random.default_rng(0))


def test_a_point_on_an_axis_has_no_circle():
    """ARIA's tool point lies on its last axis: five circles, not six."""
    aria = load_robot("aria")
    q = circle_poses(aria, 60, rng=np.random.default_rng(0))
    rows = simulate(aria, Motion(q), instrument=INSTRUMENTS["ideal"], rng=np.random.default_rng(0))
    assert [axis.joint for axis in circle_axes(aria, rows)] == [0, 1, 2, 3, 4]
