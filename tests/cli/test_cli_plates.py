"""The commands about plates, from end to end."""

import pytest


def test_score_of_table_2(told):
    found, out = told("plate", "score", "table2", "--robot", "aria")
    assert "position error, rms [mm]" in out
    assert found["schema"] == "workbench.plate-score/1"
    assert found["robot"] == "ARIA"
    assert [t["target"] for t in found["targets"]] == list(range(1, 11))
    assert found["set"]["predicted"]["position_mm"]["rms"] == pytest.approx(0.16, abs=0.02)
    assert found["one_branch"]["predicted"]["position_mm"]["rms"] == pytest.approx(1.32, abs=0.1)
    assert set(found["set"]["indices"]) == {"O", "O1", "O2", "O3", "O4", "O5", "I"}
    assert found["set"]["open"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("score", "nowhere.toml"), "nowhere.toml"),
        (("score", "table2", "--unknown", "wrist"), "--unknown must be base"),
        (("score", "table2", "--noise", "5"), "--noise: '5' has no unit"),
        (("optimise", "table2", "--out", "x.toml", "--tilt", "70deg"), "--tilt must be 0 to 65°"),
        (("yield", "table2", "--joint-noise=-1deg"), "--joint-noise must be an angle of 0 rad or more"),
    ],
)
def test_one_sentence_for_bad_input(refused, options, message):
    refused([message], "plate", *options, "--robot", "aria", status=1 if message == "nowhere.toml" else 64)
