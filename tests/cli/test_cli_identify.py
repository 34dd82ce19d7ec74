"""Rows that are clearly those of another arm, which it refuses to fit."""

import pytest
from refusals import mentions

from tests.arm.test_urdf import with_jaw


@pytest.fixture
def rows(run, tmp_path):
    assert run("simulate", "--robot", "ur5", "--poses", 40, "--seed", 2, "--out", "ur5.csv")[0] == 0
    return tmp_path / "ur5.csv"


def test_rows_of_another_arm_give_no_result_unless_forced(run, told, rows, tmp_path):
    for command in ("identify", "diagnose"):
        status, _, err = run(command, rows, "--robot", "aria", "--json", "r.json")
        assert status == 1
        assert mentions(err, "UR5 (CB3)")
        assert "--force" in err
        assert not (tmp_path / "r.json").exists()
    assert run("evaluate", rows, "--robot", "aria", "--json", "r.json")[0] == 2
    result, _ = told("identify", rows, "--robot", "aria", "--force", "--algorithm", "opt2", status=2)
    assert any("the arm is UR5 (CB3)" in text for text in result["warnings"])
    result, _ = told("identify", rows, "--robot", "ur5", "--algorithm", "opt2")
    assert not any("the arm is" in text for text in result["warnings"])


def test_of_an_arm_with_a_jaw_the_chain_is_named_and_holds(run, tmp_path):
    """Rows have the arm's two joints; the longest chain of its URDF has three."""
    urdf = with_jaw(tmp_path)
    urdf.write_text(urdf.read_text().replace('mimic joint="q3"', 'mimic joint="q1"'))  # else a gripper's
    assert run("export", urdf, "--tip", "e", "--toml", "short.toml")[0] == 0
    assert run("simulate", "--robot", "short.toml", "--poses", 30, "--out", "rows.csv")[0] == 0
    for command in ("identify", "diagnose", "evaluate"):
        status, _, err = run(command, "rows.csv", "--robot", urdf)
        assert status == 1
        assert mentions(err, "--tip f")
    assert run("identify", "rows.csv", "--robot", urdf, "--tip", "e", "--save", "cal.urdf")[0] == 0
    assert run("evaluate", "rows.csv", "--robot", "cal.urdf")[0] == 0
