"""The Katana thesis done again: what must agree does, what can't is said, and the command writes it all."""

import numpy as np
import pytest

from studies import katana_printed as printed
from studies import katana_study as ways
from studies.conftest import agree
from workbench import Motion, load_robot, tool_poses
from workbench.base import se3


@pytest.mark.slow
def test_what_must_agree_agrees(katana):
    agree(
        katana,
        ("Table 4.5", "conventional / with tilting"),
        ("Table 4.5", "conventional: mean |ΔP| at least"),
        ("Table 3.3", "mean motion"),
        ("§3.7", "influence based better by"),
    )
    circle, *_, other = (path.motion.q.mean(axis=0) for path in katana.tracking.paths)
    assert np.abs(circle - other).max() > 1.0  # another posture


def test_two_arms_have_errors_of_the_thesis_size():
    """The whole reproduction, in seconds: before, without tilting, and what tilting leaves."""
    medians = np.median(ways.katana_study(arms=2).held_out, axis=0)
    assert 0.30 < medians[ways.CONVENTIONAL] < 0.42
    assert 0.30 < medians[ways.SIMULTANEOUS] < 0.42
    assert medians[ways.FIRST] < 0.16
    assert medians[ways.TOGETHER] < 0.16
    assert medians[ways.BEFORE] > medians[ways.CONVENTIONAL]


def test_without_a_remainder_little_is_left():
    """A joint whose play hangs on a feeble moment may still be taken for lying on the other side."""
    study = ways.katana_study(arms=2, remainder=0.0)
    assert study.held_out[:, ways.TOGETHER].max() < 0.08
    assert study.held_out[:, ways.CONVENTIONAL].min() > 0.25
    assert (study.held_out[:, ways.BEFORE] > study.held_out[:, ways.CONVENTIONAL]).all()


def test_differences_by_hand():
    """Turned by 0.3° about z, ZXZ's first angle grows by it; moved by (3, 4, 0) mm, the tool by 5 mm."""
    robot = load_robot("katana450")
    pose = tool_poses(robot, Motion(np.array([[0.1, 0.5, -0.7, 0.4, 1.0]])))
    moved = pose.copy()
    moved[:, :3, :3] = se3.rotvec_to_matrix(np.array([0.0, 0.0, np.deg2rad(0.3)])) @ pose[:, :3, :3]
    moved[:, :3, 3] += [3e-3, -4e-3, 0.0]
    assert np.allclose(ways.differences(pose, moved), [[3.0, 4.0, 0.0, 5.0, 0.3, 0.0, 0.0]], atol=1e-9)


def test_stiffness_is_converted_once():
    """122 kg·m/°: 122 kilograms' weight on a metre turn the joint by a degree."""
    assert np.isclose(printed.STIFFNESS[0] * np.deg2rad(1.0), 122.0 * 9.80665)
    assert np.allclose(np.rad2deg(printed.CLEARANCE), [0.022, 0.024, 0.017, 0.015, 0.018])
