"""`workbench loading` from end to end, and what it refuses."""

import csv
import json

import numpy as np
import pytest
from refusals import mentions

from workbench.data.readers import read_measurements


def test_the_experiment_from_end_to_end(run, tmp_path):
    options = ("loading", "katana450", "--added-mass", 3, "--pairs", 2, "--seed", 2)
    status, out, err = run(*options, "--out", "found", "--json", "r.json")
    assert status == 0, err
    assert mentions(out, "joint 1")
    assert mentions(out, "3 kg")
    assert mentions(" ".join(out.split()), "2 mm")
    result = json.loads((tmp_path / "r.json").read_text())
    assert result["schema"] == "workbench.loading/1"
    assert result["unturned"] == [1]
    assert [j["joint"] for j in result["joints"]] == [1, 2, 3, 4, 5]
    for joint in result["joints"]:
        for part, within in (("clearance", 0.05), ("backlash", 0.05), ("compliance", 0.15)):
            assert joint[part]["value"] == pytest.approx(joint["hidden"][part], rel=within)
    assert {p["purpose"] for p in result["postures"]} == {"crosswise", "reversal", "size"}
    with open(tmp_path / "found" / "postures.csv") as file:
        postures = list(csv.DictReader(file))
    assert len(postures) == 2 * len(result["postures"])
    data = read_measurements(tmp_path / "found" / "readings.csv", joints=5)
    assert len(data) == len(postures)
    assert set(data.tilt) == {1, 2, 3, 4, 5}
    q = np.array([[float(row[f"q{j}[rad]"]) for j in range(1, 6)] for row in postures])
    np.testing.assert_allclose(data.q, q)
    picture = (tmp_path / "found" / "loading.svg").read_text()
    assert mentions(picture, "joint 5")
    assert "stiffness" in picture


@pytest.mark.parametrize(
    ("options", "messages"),
    [
        (("katana450", "--joints", "1"), "gravity exerts no moment about it"),
        (("katana450", "--joints", "2,7"), "joint must be 1–5, got 7"),
        (("katana450", "--joints", "two"), "--joints"),
        (("katana450", "--added-mass", "-1"), "added mass must be at least 0 kg, got -1"),
        (("katana450", "--repeats", "0"), "--repeats must be at least 1, got 0"),
        (("katana450", "--force", "0.001"), "pull harder"),
        (("katana450", "--centre-tolerance", "-1mm"), "--centre-tolerance must be at least 0 mm, got -1 mm"),
        (("katana450", "--centre-tolerance", "40mm", "--joints", "2"), "or add mass at the tool"),
        (("iiwa14",), "mass"),
    ],
)
def test_what_is_refused(refused, options, messages):
    status = 1 if messages in ("pull harder", "or add mass at the tool", "mass") else 64
    refused([messages], "loading", *options, "--out", "o", "--json", "o.json", status=status)
