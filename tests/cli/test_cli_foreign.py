"""The command line refuses to fit rows that are clearly those of another arm."""

import json

import pytest
from refusals import mentions

FEW = ("--algorithm", "opt2", "--json", "r.json")


@pytest.fixture
def rows(run, tmp_path):
    status, _, err = run("simulate", "--robot", "ur5", "--poses", 40, "--seed", 2, "--out", "ur5.csv")
    assert status == 0, err
    return tmp_path / "ur5.csv"


def test_rows_of_another_arm_give_no_result_unless_forced(run, rows, tmp_path):
    for command in ("identify", "diagnose"):
        status, _, err = run(command, rows, "--robot", "aria", "--json", "r.json")
        assert status == 1
        assert mentions(err, "UR5 (CB3)")
        assert "--force" in err
        assert not (tmp_path / "r.json").exists()
    run("identify", rows, "--robot", "aria", "--force", *FEW)
    result = json.loads((tmp_path / "r.json").read_text())
    assert any("UR5 (CB3) fits to" in text for text in result["warnings"])
    status, _, err = run("identify", rows, "--robot", "ur5", *FEW)
    assert status == 0, err
    assert not any("fits to" in text for text in json.loads((tmp_path / "r.json").read_text())["warnings"])
