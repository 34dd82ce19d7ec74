"""Each arm's page, as its reader would follow it: on virtual displays and trackers."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from displays import fill_in, hidden, model_error
from documented_commands import commands, run_lines

import workbench as wb

ARMS = Path(__file__).resolve().parents[3] / "assets" / "docs" / "arms"
HIDDEN = Path("hidden.toml")


def follow(page: str, run, makers: dict[str, Callable[[], object]]) -> None:
    """Run a page's commands; what the reader provides is made before the first command that reads it."""
    text = (ARMS / f"{page}.md").read_text(encoding="utf-8")
    waiting = dict(makers)
    if table := re.search(r"```text\n((?:type|theta).*?)```", text, re.DOTALL):
        Path({"cobot": "cobot.csv", "industrial": "kr6.csv"}[page]).write_text(table[1])
    for line in commands(text):
        parts = line.split()
        for name in [name for name in waiting if name in parts and parts[parts.index(name) - 1] != "--out"]:
            waiting.pop(name)()
        run_lines(run, [line])
    assert not waiting


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
    makers = {"form.csv": lambda: fill_in(Path("form.csv"), hidden(robot, HIDDEN, seed=3), style=style)}
    follow(page, run, makers)
    low, high = wb.load_robot("mine.toml").search_limits.T
    q = np.random.default_rng(8).uniform(low, high, (200, len(low)))
    for found in ("mine.toml", "mine.urdf"):
        assert model_error(Path(found), HIDDEN, q).mean() < 5e-5
