"""Pages of arms whose controller is asked for its model, followed on virtual displays."""

import re
from pathlib import Path

import numpy as np
import pytest
from displays import fill_in, hidden, model_error
from documented_commands import commands, run_lines

import workbench as wb

ARMS = Path(__file__).resolve().parents[3] / "assets" / "docs" / "arms"


@pytest.mark.parametrize(
    ("page", "robot", "style"),
    [
        ("franka", "fr3", "x y z"),
        pytest.param("xarm", "xarm6", "x y z", marks=pytest.mark.slow),
        pytest.param("cobot", "cobot.toml", "z y' z''", marks=pytest.mark.slow),
    ],
)
def test_the_controller_is_asked_for_its_model(page, robot, style, run):
    """The planned form is filled in as the controller of a calibrated arm shows its poses."""
    text, actual = (ARMS / f"{page}.md").read_text(encoding="utf-8"), Path("hidden.toml")
    if table := re.search(r"```text\n((?:type|theta).*?)```", text, re.DOTALL):
        Path("cobot.csv").write_text(table[1])
    for line in commands(text):
        run_lines(run, [line])
        if "--out form.csv" in line:
            fill_in(Path("form.csv"), hidden(robot, actual, seed=3), style=style)
    low, high = wb.load_robot("mine.toml").search_limits.T
    q = np.random.default_rng(8).uniform(low, high, (200, len(low)))
    for found in ("mine.toml", "mine.urdf"):
        assert model_error(Path(found), actual, q).mean() < 5e-5
