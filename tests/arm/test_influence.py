"""Influence of constants against levers measured by hand, and against the numbers that the thesis reads."""

import numpy as np
import pytest
from studies.katana_printed import CONSTANTS, PRINTED_INFLUENCE

from workbench import Motion, link_frames, tool_poses
from workbench.arm.kinematics.katana_influence import ANGLE, LENGTH_DEVIATION, influence
from workbench.plate.poses.iso_cube import iso_cube_poses


@pytest.fixture(scope="module")
def poses(katana):
    return iso_cube_poses(katana, rng=np.random.default_rng(0)).q


def test_a_length_moves_the_tool_by_itself(katana, poses):
    lengths = tuple(name for name in CONSTANTS if name.endswith((".a", ".d")))
    found = influence(katana, Motion(poses), names=lengths)
    assert np.allclose(found.distances, LENGTH_DEVIATION, atol=1e-12)


def test_an_angle_moves_the_tool_by_its_lever(katana, poses):
    """The chord of 0.05° at the tool's distance from the joint's axis, taken from the link's frame."""
    frames, tools = link_frames(katana, Motion(poses)), tool_poses(katana, Motion(poses))[:, :3, 3]
    for joint in range(5):
        found = influence(katana, Motion(poses), names=(f"joint{joint + 1}.theta",))
        axis, foot = frames[:, joint + 1, :3, 2], frames[:, joint + 1, :3, 3]
        lever = np.linalg.norm(np.cross(axis, tools - foot), axis=1)
        assert np.allclose(found.distances[:, 0], 2.0 * np.sin(ANGLE / 2.0) * lever, atol=1e-10)


def test_the_thesis_reads_like_ours(katana, poses):
    """Fig. 3.8: on average θ2 is the most influential, 0.34 mm, and α2 has 0.59 of that. Its poses are not
    listed: ours give α2 the printed motion within 10 %, and θ2 22 % less than printed, as most of our cube is
    nearer to the arm; the printed value lies within what θ2 does over the poses."""
    found = influence(katana, Motion(poses), names=CONSTANTS)
    mean = dict(zip(CONSTANTS, found.mean, strict=True))
    largest = dict(zip(CONSTANTS, found.maximum, strict=True))
    lowest = dict(zip(CONSTANTS, found.minimum, strict=True))
    assert max(mean, key=mean.get) == "joint2.theta"
    assert np.isclose(mean["joint3.alpha"], PRINTED_INFLUENCE["joint3.alpha"], rtol=0.10)
    assert np.isclose(mean["joint2.theta"], 0.78 * PRINTED_INFLUENCE["joint2.theta"], rtol=0.03)
    assert lowest["joint2.theta"] < PRINTED_INFLUENCE["joint2.theta"] < largest["joint2.theta"]
    assert largest["joint3.theta"] > lowest["joint2.theta"]  # §3.5: the order of influence changes
