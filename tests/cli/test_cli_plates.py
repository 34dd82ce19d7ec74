"""The commands about plates, from end to end."""

import json
from dataclasses import replace

import pytest
from refusals import mentions

import workbench as wb
from workbench.plate.plate_toml import load_plate, write_plate
from workbench.plate.tolerances import Production


def test_score_of_table_2(run, tmp_path):
    status, out, _ = run("plate", "score", "table2", "--robot", "aria", "--json", "score.json")
    assert status == 0
    assert "position error, rms [mm]" in out
    found = json.loads((tmp_path / "score.json").read_text())
    assert found["schema"] == "workbench.plate-score/1"
    assert found["robot"] == "ARIA"
    assert [t["target"] for t in found["targets"]] == list(range(1, 11))
    assert found["set"]["predicted"]["position_mm"]["rms"] == pytest.approx(0.16, abs=0.02)
    assert found["one_branch"]["predicted"]["position_mm"]["rms"] == pytest.approx(1.32, abs=0.1)
    assert set(found["set"]["indices"]) == {"O", "O1", "O2", "O3", "O4", "O5", "A", "D", "I"}
    assert found["set"]["open"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("score", "nowhere.toml"), "nowhere.toml"),
        (("score", "table2", "--unknown", "wrist"), "--unknown must be base"),
        (("score", "table2", "--noise", "much"), "much"),
        (("compare", "table2"), "at least two plates"),
    ],
)
def test_one_sentence_for_bad_input(refused, options, message):
    refused([message], "plate", *options, "--robot", "aria", status=1 if message == "nowhere.toml" else 64)


def test_plates_are_compared_as_if_made_alike(run, tmp_path, aria):
    """The same targets, once with a tolerance and play: no difference but in what each file says."""
    plate = load_plate("table2")
    plate = plate.with_joints(wb.score(aria, plate).measured.q, plate.branches)
    write_plate(plate, tmp_path / "one.toml")
    made = Production(position=5e-5, angle=8.7e-4, play=(1.2e-5, 1.4e-3))
    write_plate(replace(plate, name="Other", production=made), tmp_path / "other.toml")
    options = ("plate", "compare", "one.toml", "other.toml", "--robot", "aria", "--json", "c.json")
    status, out, _ = run(*options)
    out = " ".join(out.split())
    assert status == 0
    assert mentions(out, "±0.05 mm, ±0.05°", "±0.012 mm, ±0.08°")
    assert mentions(out, "Table 2", "0.1 mm, 0.02°")
    found = json.loads((tmp_path / "c.json").read_text())
    one, other = ([p["set"]["predicted"], p["as_stated"]["predicted"]] for p in found["plates"])
    assert one[0] == other[0] == other[1]
    assert one[1]["position_mm"]["rms"] < 0.9 * one[0]["position_mm"]["rms"]
    status, out, _ = run(*options, "--tolerance", "0mm,0deg", "--play", "none")
    assert status == 0
    again = json.loads((tmp_path / "c.json").read_text())["plates"]
    assert again[1]["set"]["predicted"] == one[1]
    status, out, _ = run("plate", "compare", "one.toml", "./one.toml", "--robot", "aria")
    assert status == 0
    assert mentions(" ".join(out.split()), "Table 2 (one.toml)")
