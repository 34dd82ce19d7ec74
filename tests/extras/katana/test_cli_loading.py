"""`workbench loading` from end to end, and what it refuses."""

import json

import numpy as np
import pytest
from refusals import mentions

from workbench.data.readers import read_measurements


def test_the_experiment_from_end_to_end(run, tmp_path):
    options = ("loading", "katana450", "--added-mass", 3, "--pairs", 2, "--seed", 2)
    status, out, err = run(*options, "--out", "found.csv", "--json", "r.json")
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
    data = read_measurements(tmp_path / "found.csv", joints=5)
    assert set(data.tilt) == {1, 2, 3, 4, 5}
    planned = [(q, kg) for p in result["postures"] for q, kg in zip(p["q"], p["added_kg"], strict=True)]
    np.testing.assert_allclose(data.q, [q for q, _ in planned])
    np.testing.assert_allclose(data.payload, [kg for _, kg in planned])
