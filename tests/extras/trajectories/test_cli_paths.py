"""Trajectories from end to end at the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
from refusals import refuses

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base.errors import DataError, FileError
from workbench.data.readers import read_measurements, read_trajectory

CENTRE, RADIUS = np.array([0.37, 0.3, 0.25]), 0.08
CIRCLE = ("--through", "0.45,0.3,0.25", "--through", "0.37,0.38,0.25", "--through", "0.29,0.3,0.25")


@pytest.fixture
def circle(run):
    """A level circle of ARIA's."""
    options = ("path", "circle", "--robot", "aria", *CIRCLE, "--duration", 8, "--rows", 120)
    status, out, err = run(*options, "--out", "c.csv", "--json", "c.json")
    assert status == 0, err
    assert "held along" in out
    assert "-0.000" not in out
    return read_trajectory("c.csv", joints=6)


def test_a_circle_is_written_with_joints_poses_and_loads(circle):
    """Joints that stand for the poses beside them; the result carries speeds, torques and moments."""
    arm = load_robot("aria")
    np.testing.assert_allclose(tool_poses(arm, Motion(circle.q))[:, :3, 3], circle.position, atol=1e-9)
    away = circle.position - CENTRE
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), RADIUS, atol=1e-9)
    np.testing.assert_allclose(away[:, 2], 0.0, atol=1e-9)
    found = json.loads(Path("c.json").read_text())
    assert found["schema"] == "workbench.path/1"
    assert np.shape(found["velocity"]) == np.shape(found["moment_x"]) == (120, 6)
    assert np.abs(found["velocity"])[[0, -1]].max() < 1e-9


def test_a_circle_read_as_measurements_is_where_the_arm_is(run):
    """Its poses are in the robot's base, which the file says; the Katana's base is 216 mm from the origin."""
    points = ("0.1,-0.3,0.139", "0,-0.371,0.21", "-0.1,-0.3,0.139")
    through = [word for point in points for word in ("--through", point)]
    status, _, err = run("path", "circle", "--robot", "katana450", *through, "--rows", 30, "--out", "k.csv")
    assert status == 0, err
    assert run("evaluate", "k.csv", "--robot", "katana450", "--json", "e.json")[0] == 0
    assert json.loads(Path("e.json").read_text())["errors"]["position_mm"]["max"] < 1e-6
    with refuses(FileError, "base", "'pose_frame'", path="k.csv"):
        read_measurements("k.csv")
    text = Path("k.csv").read_text().replace("robot-base", "measuring")
    Path("m.csv").write_text(text)
    with refuses(DataError, column="pose_frame"):
        read_trajectory("m.csv")
    Path("m.csv").write_text(text.replace("measuring", "elsewhere", 1))
    with refuses(FileError, "robot-base", "measuring", "'elsewhere'", line=2, column="pose_frame"):
        read_measurements("m.csv")


def test_a_compensated_circle_is_corrected_where_only_positions_count(run, refused, circle):
    refused((), "compensate", "c.csv", "--robot", "ur5", "--nominal", "aria", "--out", "k.csv", status=1)
    head = ",".join(["time[s]", *(f"q{k}[deg]" for k in range(1, 7))])
    table = np.column_stack([circle.time, np.rad2deg(circle.q)])
    np.savetxt("d.csv", table, delimiter=",", header=head, comments="", fmt="%.17g")
    for name in "cd":
        options = ("compensate", f"{name}.csv", "--robot", "aria-table4", "--nominal", "aria")
        assert run(*options, "--out", f"k{name}.csv", "--positions-only")[0] == 0
    own, shown = (read_trajectory(f"k{name}.csv", joints=6) for name in "cd")
    np.testing.assert_allclose(shown.q, own.q, atol=1e-9)
    assert Path("kd.csv").read_text().partition("\n")[0] == head
