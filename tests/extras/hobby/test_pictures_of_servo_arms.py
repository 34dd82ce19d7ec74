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
from round_trip import write_table
from servo_arm import NAMES, ServoArm, poses

import workbench as wb

PAGE = Path(__file__).parents[3] / "assets" / "docs" / "hobby.md"
HALF = 0.5
"""Size of the print, relative to that of `board_on_tool`: squares of 15 mm."""
COUNT = 20
EYE = look([0.62, 0.08, 0.3], [0.25, 0.0, 0.15])
BOARD = pose([-0.0375, -0.0525, 0.06], [0.0, 0.0, 0.0])
MIDDLE = np.array([0.0375, 0.0525, 0.0, 1.0])


@pytest.fixture
def here(tmp_path):
    """`pictures/`, `counts.csv`, `poses.csv`, `follower.json`, `camera.toml` and `target.toml`."""
    arm, rng = ServoArm(11), np.random.default_rng(1)
    (tmp_path / "pictures").mkdir()
    q = arm.drawn(900, 4)
    at = np.linalg.inv(EYE) @ poses(q, stiffness=arm.stiffness) @ BOARD
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
    rows = ([f"{k}.png", *row[::-1]] for k, row in enumerate(counts))  # their names tell which is which
    write_table(tmp_path / "counts.csv", ["image", *(f"{name}[counts]" for name in NAMES[::-1])], rows)
    frames = map(wb.Frame.from_pose, at[chosen])
    rows = ([*row, *frame.xyz, *frame.rpy] for row, frame in zip(counts, frames, strict=True))
    write_table(tmp_path / "poses.csv", f"{head},x[m],y[m],z[m],roll[rad],pitch[rad],yaw[rad]", rows)
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
