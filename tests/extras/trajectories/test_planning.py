"""Trajectories: curves, one branch, speeds, loads, against the generator and plain geometry."""

import generator
import numpy as np
import pytest
from refusals import refuses
from scipy.integrate import trapezoid

from workbench.arm.robot_toml import read_toml
from workbench.base.errors import DataError, OptionError
from workbench.extras.trajectories.curves import circle_through, line, smooth_shares
from workbench.extras.trajectories.planning import plan

THESIS = 1e-3 * np.array(
    [[100, -300, 139.2893], [0, -370.7107, 210], [-100, -300, 139.2893], [0, -229.2893, 68.5786]]
)
"""The four points of §5.5.1, beginning with the left-most one."""


@pytest.fixture(scope="module")
def robots(tmp_path_factory):
    """ARIA and a Katana with its 130 mm of pencil holder, on bases that must not matter."""
    folder, found = tmp_path_factory.mktemp("robots"), {}
    for name, arm, tool in (("aria", generator.aria(), 0.1), ("katana", generator.katana(), 0.33)):
        turned = arm.tool[:3, :3]
        table = arm.toml(name).replace("xyz = [0.0, 0.0, 0.0]", "xyz = [0.1, 0.2, 0.3]", 1)
        (folder / f"{name}.toml").write_text(table)
        robot = read_toml(folder / f"{name}.toml")
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = turned, tool * turned[:, 2]
        found[name] = robot.with_frames(tool=type(robot.tool).from_pose(pose)), pose, arm
    return found


@pytest.fixture(scope="module")
def circle(robots):
    """The thesis's circle, planned."""
    return plan(robots["katana"][0], circle_through(THESIS), duration=20.0, rows=200)


def reached(arm, tool, q):
    """The generator's tool positions in the arm's first frame."""
    return (np.linalg.inv(arm.base) @ arm.pose(q) @ np.linalg.inv(arm.tool) @ tool)[:, :3, 3]


def test_the_circle_of_the_thesis():
    """Centre, radius and the plane at 45° from the printed points."""
    found = circle_through(THESIS)
    np.testing.assert_allclose(found.centre, [0, -0.3, 0.1392893], atol=1e-7)
    assert found.radius == pytest.approx(0.1, abs=1e-7)
    np.testing.assert_allclose(np.abs(found.normal), [0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-6)
    np.testing.assert_allclose(found.points(np.array([0, 0.25, 0.5, 0.75])), THESIS, atol=1e-7)


def test_noisy_points_give_the_nearest_circle():
    rng = np.random.default_rng(0)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 400))
    turn = generator.rotation(np.array([0.3, -0.8, 0.2]))
    points = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(400)]) * 0.07 @ turn.T + [1, 2, 3]
    found = circle_through(points + 1e-4 * rng.standard_normal(points.shape))
    np.testing.assert_allclose(found.centre, [1, 2, 3], atol=5e-5)
    assert found.radius == pytest.approx(0.07, abs=5e-5)
    assert found.normal @ turn[:, 2] > 1 - 1e-5


def test_a_katana_leads_its_tool_along_the_circle(robots, circle):
    """Positions by other code, closed, smooth, the axis within some degrees of the plane's normal."""
    _, tool, arm = robots["katana"]
    wanted = circle_through(THESIS).points(smooth_shares(circle.time))
    np.testing.assert_allclose(reached(arm, tool, circle.q), wanted, atol=1e-8)
    np.testing.assert_allclose(circle.q[-1], circle.q[0], atol=1e-6)
    assert ((circle.q > arm.limits[:, 0]) & (circle.q < arm.limits[:, 1])).all()
    angle = np.rad2deg(np.arccos(circle.poses[:, :3, 2] @ [0, -np.sqrt(0.5), -np.sqrt(0.5)]))
    assert 1.0 < angle.max() < 15.0
    assert any(f"within {angle.max():.1f}°" in note for note in circle.notes)


def test_speeds_are_the_derivatives_of_the_joints(circle):
    """Integrated they give the way back; finite differences of the tool's path give the Jacobian's."""
    travel = trapezoid(circle.motion.velocity, circle.time, axis=0)
    np.testing.assert_allclose(travel, circle.q[-1] - circle.q[0], atol=1e-6)
    middle = np.diff(circle.q, axis=0) / np.diff(circle.time)[:, None]
    half = 0.5 * (circle.motion.velocity[1:] + circle.motion.velocity[:-1])
    np.testing.assert_allclose(half, middle, atol=1e-3)
    change = np.diff(circle.motion.velocity, axis=0) / np.diff(circle.time)[:, None]
    half = 0.5 * (circle.motion.acceleration[1:] + circle.motion.acceleration[:-1])
    np.testing.assert_allclose(half, change, atol=1e-2)
    assert np.abs(circle.motion.velocity[[0, -1]]).max() < 1e-9


def test_six_joints_hold_the_whole_orientation(robots):
    robot, tool, arm = robots["aria"]
    found = plan(robot, line(np.array([0.45, 0.3, 0.25]), np.array([0.3, 0.45, 0.2])), duration=5.0, rows=50)
    np.testing.assert_allclose(found.poses[:, :3, :3], found.poses[:1, :3, :3].repeat(50, 0), atol=1e-8)
    np.testing.assert_allclose(found.poses[0, :3, 2], [0, 0, -1], atol=1e-8)
    ends = reached(arm, tool, found.q)[[0, -1]]
    np.testing.assert_allclose(ends, [[0.45, 0.3, 0.25], [0.3, 0.45, 0.2]], atol=1e-8)


def test_what_forbids_a_path_is_named(robots):
    katana = robots["katana"][0]
    with pytest.raises(DataError, match=r"row \d+ .*\(at \d+\.\d+ s\).* off; the poses are"):
        plan(katana, line(np.array([0.1, -0.37, 0.21]), np.array([-0.1, -0.8, 0.07])), duration=9.0)
    with refuses(OptionError, option="points"):
        circle_through(np.array([[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]]))
