"""Rendered pictures of a printed board on the gripper become the map of the motors; the page's commands."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cv2")
pytest.importorskip("mujoco")

import cv2
from board_on_tool import CAMERA, DOT, LENS, SIZE, TARGET, paper, pose
from camera_arms import look
from documented_commands import run_lines
from rendered_boards import render
from servo_arm import NAMES, ServoArm, poses

import workbench as wb

PAGE = Path(__file__).parents[3] / "assets" / "docs" / "hobby.md"
HALF = 0.5
"""Size of the print, relative to that of `board_on_tool`: squares of 15 mm."""
COUNT = 20
EYE = look([0.62, 0.08, 0.3], [0.25, 0.0, 0.15])
BOARD = pose([-0.0375, -0.0525, 0.06], [0.0, 0.0, 0.0])
MIDDLE = np.array([0.0375, 0.0525, 0.0, 1.0])


def sights(arm, q):
    """Poses of the board in the camera."""
    return np.linalg.inv(EYE) @ poses(q, stiffness=arm.stiffness) @ BOARD


@pytest.fixture(scope="module")
def arm():
    return ServoArm(11)


@pytest.fixture
def here(arm, tmp_path):
    """`pictures/`, `counts.csv`, `poses.csv`, `follower.json`, `camera.toml` and `target.toml`."""
    rng = np.random.default_rng(1)
    (tmp_path / "pictures").mkdir()
    q = arm.drawn(900, 4)
    at = sights(arm, q)
    middle = at @ MIDDLE
    spot = np.abs(middle[:, :2] / middle[:, 2:3]) * LENS[:2]
    near = (middle[:, 2] > 0.15) & (middle[:, 2] < 0.5) & (spot < [150, 110]).all(1) & (at[:, 2, 2] > 0.7)
    chosen = np.flatnonzero(near)[:COUNT]
    assert len(chosen) == COUNT
    sheet = paper()
    for k, target in enumerate(at[chosen]):
        picture = render(sheet, DOT * HALF, target, LENS, SIZE, rng=rng)
        cv2.imwrite(str(tmp_path / "pictures" / f"{k}.png"), picture)
    counts = arm.counts(q[chosen])
    head = ",".join(f"{name}[counts]" for name in NAMES)
    lines = [
        f"image,{head}",
        *(f"{k}.png,{','.join(map(str, row))}" for k, row in enumerate(counts.tolist())),
    ]
    (tmp_path / "counts.csv").write_text("\n".join(lines))
    frames = [wb.Frame.from_pose(target) for target in at[chosen]]
    numbers = [
        [*row, *frame.xyz.tolist(), *frame.rpy.tolist()]
        for row, frame in zip(counts.tolist(), frames, strict=True)
    ]
    lines = [
        f"{head},x[m],y[m],z[m],roll[rad],pitch[rad],yaw[rad]",
        *(",".join(map(repr, row)) for row in numbers),
    ]
    (tmp_path / "poses.csv").write_text("\n".join(lines))
    entry = {"drive_mode": 0, "homing_offset": 100, "range_min": 800, "range_max": 3295}
    table = {name: {"id": k, **entry} for k, name in enumerate((*NAMES, "gripper"), 1)}
    (tmp_path / "follower.json").write_text(json.dumps(table))
    (tmp_path / "camera.toml").write_text(CAMERA)
    (tmp_path / "target.toml").write_text(TARGET.replace("0.03", "0.015").replace("0.022", "0.011"))
    return tmp_path


def test_the_commands_of_the_page(run, here):
    shown = re.findall(r"^workbench .*", PAGE.read_text(encoding="utf-8").replace("\\\n", " "), re.MULTILINE)
    assert len(shown) >= 4
    run_lines(run, [line for line in shown if " board " not in line])
