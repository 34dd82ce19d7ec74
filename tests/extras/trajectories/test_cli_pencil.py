"""Pencil and paper from end to end at the command line, and as its page shows it."""

import json
from pathlib import Path

import numpy as np
import pytest
from documented_commands import commands, run_lines

from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.arm.robot_toml import write_toml
from workbench.data.readers import read_trajectory

PAGE = Path(__file__).resolve().parents[3] / "assets" / "docs" / "pencil.md"
CENTRE, RADIUS = np.array([0.37, 0.3, 0.25]), 0.08
CIRCLE = ("--through", "0.45,0.3,0.25", "--through", "0.37,0.38,0.25", "--through", "0.29,0.3,0.25")


def test_a_circle_is_drawn_and_read(run, refused):
    """An arm whose second joint is off by 2 mrad: what was read is what its kinematics say."""
    options = ("path", "circle", "--robot", "aria", *CIRCLE, "--duration", 8, "--rows", 120)
    assert run(*options, "--out", "c.csv")[0] == 0
    circle = read_trajectory("c.csv", joints=6)
    arm = load_robot("aria").with_values({"joint2.theta": 2e-3})
    write_toml(arm, "real.toml")
    options = ("pencil", "draw", "c.csv", "--robot", "real.toml", "--dpi", 150, "--out", "scan.png")
    assert run(*options, "--readings", "pot.csv")[0] == 0
    options = ("pencil", "errors", "scan.png", "--radius", "80mm", "--path", "c.csv", "--readings", "pot.csv")
    status, out, _ = run(*options, "--json", "e.json", "--picture", "e.png")
    assert status == 0
    assert "mean [mm]" in out
    read = np.array(json.loads(Path("e.json").read_text())["errors_mm"])
    away = 1e3 * (tool_poses(arm, Motion(circle.q))[:, :3, 3] - circle.position)
    ray = (circle.position - CENTRE) / RADIUS
    wanted = np.sum(away * ray, axis=1)[:, None] * ray + away[:, 2:] * [0.0, 0.0, 1.0]
    assert np.linalg.norm(wanted, axis=1).mean() > 0.5
    assert np.linalg.norm(read - wanted, axis=1).mean() < 0.06
    refused(["80 mm"], *options[:4], "90mm", *options[5:], status=64)
    assert run("pencil", "errors", "c.png")[0] == 1


def test_the_commands_of_the_page(run, tmp_path):
    lines = commands(PAGE.read_text(encoding="utf-8"))
    assert len(lines) == 4
    run_lines(run, lines)
    assert (tmp_path / "sheet.png").is_file()
    assert (tmp_path / "errors.png").is_file()
    missed = np.linalg.norm(json.loads((tmp_path / "errors.json").read_text())["errors_mm"], axis=1)
    assert missed.mean() == pytest.approx(1.0, abs=0.1)


def test_the_sheet_is_there_though_nobody_reads(run_unread, tmp_path):
    assert run_unread("pencil", "sheet", "--dpi", "60", "--out", "sheet.png")[0] == 0
    assert (tmp_path / "sheet.png").is_file()
