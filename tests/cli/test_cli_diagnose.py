"""The command that finds what the geometry lacks, and what its saved arm is good for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workbench import Motion, evaluate, identify, load_robot, measure_poses, tool_poses, write_measurements
from workbench.arm.effects.backlash import Backlash


@pytest.fixture(scope="module")
def soft(tmp_path_factory) -> Path:
    """A folder with `soft.csv`: an ARIA that gives way in joint 2, measured at 70 poses."""
    folder = tmp_path_factory.mktemp("soft")
    _, rows = measure_poses(load_robot("aria"), 70, effects=("joint-compliance:2:5e-5",), seed=3)
    write_measurements(replace(rows, sigma=None), folder / "soft.csv")
    return folder


@pytest.fixture(scope="module")
def moved():
    """An arm with play that follows the motion, and rows in the order of time, without directions."""
    loose = load_robot("aria").with_effects(Backlash((2,), (1e-3,), by="motion"))
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (30, 6))
    _, rows = measure_poses(load_robot("aria"), 30, actual=load_robot("aria"), instrument="ideal", seed=1)
    sign = np.sign(np.diff(q, axis=0, prepend=q[:1]))
    poses = tool_poses(loose, Motion(q, direction=sign))
    rows = replace(
        rows, q=q, position=poses[:, :3, 3], rotation=poses[:, :3, :3], time=10.0 * np.arange(30), sigma=None
    )
    return loose, rows


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--save", "c.txt"), ".toml"),
        (("--report", "file"), "file: "),
        (("--exclude", "70"), "70"),
        (("--noise", "-1mm"), "must be positive"),
    ],
)
def test_a_mistake_gets_one_sentence_and_writes_nothing(refused, soft, options, message):
    Path("file").write_text("")
    command = ("diagnose", soft / "soft.csv", "--robot", "aria", "--json", "r.json", *options)
    refused([message], *command, status=1 if message == "file: " else 64)


# -- saved effects where data enter ---------------------------------------------------------------


def test_directions_come_from_the_order_in_time(moved):
    loose, rows = moved
    found = evaluate(loose, rows)
    assert found.errors.position_mm.max < 1e-6
    assert any("direction of motion" in note for note in found.notes)
    run = identify(loose, rows, algorithms=("ols",), held_out=0.2)
    assert run.best.held_out.position_mm.max < 1e-5
    assert any("direction of motion" in note for note in run.notes)
    held = identify(loose, rows.take(np.arange(20)), algorithms=("ols",), held_out=rows)
    assert held.best.held_out.position_mm.max < 1e-5
