"""A virtual source: what its arm does, and what its command refuses."""

import subprocess
import sys
from itertools import islice

import numpy as np
import pytest
from slow import slow

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.extras.live.connection import connect
from workbench.extras.live.driver import JOINT_NOISE, TURNING, drive
from workbench.extras.live.sample import parse_sample
from workbench.plate.measured_plate import load_plate

ARM, PLATE = load_robot("aria"), load_plate("table2")


@pytest.mark.parametrize("is_cut", [False, slow(True)])
def test_lines_of_a_virtual_source(is_cut, tmp_path):
    """The arm stands at its targets whenever it asks; whoever reads no further ends it without a word."""
    program = [sys.executable, "-m", "workbench", "drive", "--robot", "aria", "--plate", "table2", "--to"]
    options = ["127.0.0.1:0", "--speed", "0", "--actual", str(tmp_path / "hidden.toml")]
    with subprocess.Popen([*program, *options], stderr=subprocess.PIPE, text=True) as source:
        port = source.stderr.readline().rpartition(" ")[2].strip()
        with connect(f"127.0.0.1:{port}") as lines:
            sent = [parse_sample(line, line=1) for line in islice(lines, 1 if is_cut else None)]
        assert source.stderr.read() == ""
    assert source.returncode == 0
    if is_cut:
        return
    assert np.all(np.diff([sample.time for sample in sent]) > 0.0)
    kept = [sample for sample in sent if sample.capture]
    predicted = tool_poses(load_robot(str(tmp_path / "hidden.toml")), Motion(np.stack([s.q for s in kept])))
    np.testing.assert_allclose([s.position for s in kept], predicted[:, :3, 3], atol=4e-4)
    assert np.abs(se3.pose_error(predicted, PLATE.poses)).max() < 3e-3


def test_the_arm_moves_smoothly_and_within_its_speed():
    rate, targets = 100.0, np.array([[0.5, 0.2, 0.0, -1.0, 0.3, 0.1], [0.0, 0.4, 0.1, 1.0, 0.3, 0.1]])
    samples = list(drive(ARM, targets, rng=np.random.default_rng(0), rate=rate))
    q = np.stack([sample.q for sample in samples])
    speed = np.abs(np.diff(q, axis=0)).max() * rate
    assert 0.98 * TURNING < speed <= TURNING + 10.0 * JOINT_NOISE * rate
    assert np.abs(np.diff(q, n=2, axis=0)).max() * rate**2 < 5.0
    kept = [sample.q for sample in samples if sample.capture]
    np.testing.assert_allclose(kept, targets, atol=6.0 * JOINT_NOISE)
