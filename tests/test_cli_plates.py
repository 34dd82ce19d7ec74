"""The commands about plates, from end to end."""

import json

import pytest


def test_score_of_table_2(run, tmp_path):
    status, out, _ = run("plate", "score", "table2", "--robot", "aria", "--json", "score.json")
    assert status == 0
    assert "position error, rms [mm]" in out
    found = json.loads((tmp_path / "score.json").read_text())
    assert found["schema"] == "workbench.plate-score/1"
    assert found["robot"] == "ARIA"
    assert [t["target"] for t in found["targets"]] == list(range(1, 11))
    assert found["set"]["predicted"]["position_mm"]["rms"] == pytest.approx(0.16, abs=0.02)
    assert found["one_branch"]["predicted"]["position_mm"]["rms"] == pytest.approx(1.2, abs=0.1)
    assert set(found["set"]["indices"]) == {"O", "O1", "O2", "O3", "O4", "O5", "A", "D", "I"}
    assert found["set"]["open"] == []


def test_score_says_what_is_not_told_apart(run):
    status, out, _ = run("plate", "score", "table2", "--robot", "aria", "--unknown", "base,tool")
    assert status == 0
    assert "not told apart: base x with tool x" in out


def test_plates_compared(run, tmp_path):
    words = ("plate", "compare", "table2", "table2", "--robot", "aria", "--json", "both.json")
    status, out, _ = run(*words)
    assert status == 0
    assert "smallest predicted position error: Table 2" in out
    assert len(json.loads((tmp_path / "both.json").read_text())["plates"]) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("score", "nowhere.toml"), "nowhere.toml"),
        (("score", "table2", "--unknown", "wrist"), "--unknown takes base"),
        (("score", "table2", "--noise", "much"), "much"),
        (("compare", "table2"), "two plates or more"),
    ],
)
def test_one_sentence_for_bad_input(run, words, said):
    status, out, err = run("plate", *words, "--robot", "aria")
    assert status == 1
    assert said in err
    assert err.count("\n") == 1
    assert not out
