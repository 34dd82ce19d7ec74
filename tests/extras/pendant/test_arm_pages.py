"""Each arm's page, as its reader would follow it: on virtual displays and trackers."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from displays import fill_in, hidden, model_error, poses
from documented_commands import commands, run_lines
from round_trip import placed, read_arm, rows_of

import workbench as wb

ARMS = Path(__file__).resolve().parents[3] / "assets" / "docs" / "arms"
HIDDEN = Path("hidden.toml")
REFLECTOR = placed([0.05, 0.12, 0.08], [0.0, 0.0, 0.0])
STATION = placed([2.1, -0.4, 0.3], [0.01, 0.02, 1.2])
PROGRAMS = {
    "weld.src": "DEF weld()\nPTP {A1 10.00,A2 -80.00,A3 95.00,A4 15.00,A5 40.00,A6 20.00} ; seam\nEND\n",
    "pick.script": "def pick():\n  movej([0.1, -1.2, 1.5, -1.9, -1.5, 0.3], a=1.4, v=1.0)  # above\nend\n",
}


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


def joints(count: int, seed: int) -> np.ndarray:
    low, high = np.deg2rad([[-120, -130, 30, -150, -100, -170], [120, -40, 130, 150, 100, 170]])
    return np.random.default_rng(seed).uniform(low, high, (count, 6))


def seen(q: np.ndarray) -> np.ndarray:
    """Places of the reflector on the hidden arm in the tracker's frame [m]."""
    return (STATION @ poses(HIDDEN, q, REFLECTOR))[:, :3, 3]


def track(robot: str) -> None:
    """60 rows of a tracker with 0.02 mm of noise, and a hidden arm with errors of 0.5 mm and 1 mrad."""
    hidden(robot, HIDDEN, seed=5, length=5e-4, angle=1e-3)
    q = joints(60, 1)
    places = seen(q) + np.random.default_rng(2).normal(0.0, 2e-5, (60, 3))
    head = ",".join([*(f"q{k}[deg]" for k in range(1, 7)), "x[mm]", "y[mm]", "z[mm]"])
    table = np.hstack([np.rad2deg(q), 1e3 * places])
    np.savetxt("tracker.csv", table, delimiter=",", header=head, comments="")


def off(calibrated: str) -> float:
    """Mean distance of the reflector from where a calibrated arm expects it, at fresh poses [m]."""
    q = joints(40, 9)
    return float(np.linalg.norm(read_arm(Path(calibrated))(rows_of(q))[1][:, :3, 3] - seen(q), axis=1).mean())


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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "robot", "program", "calibrated"),
    [
        ("ur", "factory.toml", "pick.script", "measured.toml"),
        ("industrial", "kr6.toml", "weld.src", "calibrated.toml"),
    ],
)
def test_a_tracker_calibrates_the_arm_and_its_program_is_corrected(page, robot, program, calibrated, run):
    deltas = np.random.default_rng(4).normal(0.0, [1e-3, 5e-4, 5e-4, 1e-3], (6, 4))
    deltas[2, 2] = 0.0
    names = ("theta", "d", "a", "alpha")
    lines = [f"delta_{name} = {column.tolist()}" for name, column in zip(names, deltas.T, strict=True)]
    Path("calibration.conf").write_text("\n".join(["[mounting]", *lines, ""]))
    makers = {
        "tracker.csv": lambda: track(robot),
        program: lambda: Path(program).write_text(PROGRAMS[program]),
    }
    if page == "ur":
        makers["form.csv"] = lambda: fill_in(Path("form.csv"), hidden("ur5e", Path("pendant-hidden.toml")))
    follow(page, run, makers)
    assert off(calibrated) < 5e-5
    corrected, number = Path(program.replace(".", "_corrected.")).read_text(), r"-?\d+\.\d+"
    assert re.split(number, corrected) == re.split(number, PROGRAMS[program])
    assert corrected != PROGRAMS[program]
