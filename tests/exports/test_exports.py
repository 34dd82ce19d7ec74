"""Formats of `--for`: the file is the arm that it says, to readers of other code."""

import re
from pathlib import Path

import numpy as np
import pytest
from checks import any_joints, with_errors

from tests.exports import readers
from workbench import Frame, Motion, Robot, load_robot, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.errors import RobotError, ShapeError
from workbench.exports import FORMS, Job, export_robot

EXACT = 1e-9
flanges = lambda arm, q: tool_poses(arm.with_frames(base=Frame(), tool=Frame()), Motion(q))  # noqa: E731


def calibrated(name: str, seed: int = 0) -> tuple[Robot, Robot]:
    """A nominal arm, and one like it with constants that are a little off and a tool; without effects."""
    nominal = load_robot(name).with_effects()
    rng = np.random.default_rng(seed)
    arm = with_errors(nominal, rng.normal(0.0, 1e-3, len(nominal.default_free)))
    tool = Frame(np.array([0.01, -0.02, 0.12]), se3.rpy_to_matrix(np.array([0.1, -0.2, 0.3])))
    return nominal, arm.with_frames(base=Frame(), tool=tool)


@pytest.mark.parametrize("name", built_in_robots())
def test_spreadsheets_hold_the_arm(name, tmp_path):
    _, arm = calibrated(name)
    done = export_robot(FORMS["dh-csv"], tmp_path / "t.csv", Job(robot=arm), rows=40)
    assert max(done.position, done.rotation) < EXACT
    assert "agrees" in done.verdict
    text = done.path.read_text()
    pose, q = readers.spreadsheet(text), any_joints(arm, 20, seed=1)
    for row, wanted in zip(q, flanges(arm, q), strict=True):
        np.testing.assert_allclose(pose(row), wanted, atol=EXACT)


def test_what_effects_cost_is_in_the_figure(tmp_path):
    _, arm = calibrated("aria")
    deflected = arm.with_effects(EFFECTS["joint-compliance"]((1,), (1e-4,)))
    done = export_robot(FORMS["dh-csv"], tmp_path / "k.csv", Job(robot=deflected), rows=40)
    assert 1e-4 < done.position < 1e-2
    assert any("joint-compliance" in note for note in done.notes)
    warm = arm.with_effects(EFFECTS["thermal-growth"]((), (2e-5,)))
    done = export_robot(FORMS["dh-csv"], tmp_path / "k.csv", Job(robot=warm), rows=5)
    assert done.position < EXACT
    assert any("does not include" in note and "thermal-growth" in note for note in done.notes)


def test_the_command(run, told, tmp_path):
    out: Path = tmp_path / "k.csv"
    found, message = told("export", "ur5", "--for", "dh-csv", "--out", out)
    assert "1e-09" in message
    assert found["left"]["position_m"] < EXACT
    for options in (["--for", "nonsense", "--out", out], ["--for", "dh-csv"], ["--out", out]):
        code, _, error = run("export", "ur5", *options)
        assert code == 64, options
        assert "--" in error or "choose" in error


def test_no_table_is_written_against_another_arms_nominal_model(tmp_path):
    path = tmp_path / "file"
    for name, other in (("aria", "ur5"), ("ur5e", "ur5"), ("iiwa14", "panda"), ("panda", "ur5")):
        with pytest.raises((RobotError, ShapeError), match=re.escape(load_robot(other).name)):
            export_robot(FORMS["dh-csv"], path, Job(robot=calibrated(name)[1], nominal=load_robot(other)))
    assert not path.exists()
