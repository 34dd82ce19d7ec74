"""Generated bodies: they hang together, for every built-in arm."""

import numpy as np
import pytest

from workbench import Motion, load_robot, tool_poses
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.views.appearance.bodies import body_frames, make_bodies


@pytest.mark.parametrize("name", built_in_robots())
def test_the_last_body_ends_at_the_tool(name):
    robot = load_robot(name)
    q = np.random.default_rng(3).uniform(-1, 1, robot.dof)
    bodies, frames = make_bodies(robot), body_frames(robot, q)
    assert len(bodies) == len(frames) == robot.dof + 1
    tool = (se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(q[None]))[0])[:3, 3]
    vertices = se3.apply(frames[-1], bodies[-1].solid.vertices)
    assert np.linalg.norm(vertices - tool, axis=1).min() < 0.06 * robot.reach
