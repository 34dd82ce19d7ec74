"""Generated bodies: they hang together, for every built-in arm."""

import numpy as np
import pytest

from workbench import Motion, load_robot, tool_poses
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.views.appearance.bodies import body_frames, make_bodies
from workbench.views.appearance.shapes import target_block


@pytest.mark.parametrize("name", built_in_robots())
def test_the_last_body_ends_at_the_tool(name):
    robot = load_robot(name)
    q = np.random.default_rng(3).uniform(-1, 1, robot.dof)
    bodies, frames = make_bodies(robot), body_frames(robot, q)
    assert len(bodies) == len(frames) == robot.dof + 1
    tool = (se3.inverse(robot.base.pose) @ tool_poses(robot, Motion(q[None]))[0])[:3, 3]
    vertices = se3.apply(frames[-1], bodies[-1].solid.vertices)
    assert np.linalg.norm(vertices - tool, axis=1).min() < 0.06 * robot.reach


@pytest.mark.parametrize("roll", [-180.0, -150.0, -90.0, 0.0])
def test_a_block_has_the_target_on_its_face_and_its_faces_outwards(roll):
    place = np.array([0.3, 0.4, 0.25])
    pose = se3.pose(se3.rpy_to_matrix(np.deg2rad([roll, 0.0, 30.0])), place)
    solid = target_block(pose, se3.pose(np.eye(3), np.array([0.3, 0.3, 0.18])))
    corners = solid.vertices[solid.faces] - solid.vertices.mean(0)
    assert np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).min() > 0
    heights = (solid.vertices - place) @ pose[:3, 2]
    assert np.sort(np.abs(heights))[:4] == pytest.approx(0.0, abs=1e-12)
    assert heights.min() > -1e-9  # the block lies behind the face, where the tool's z axis points
