"""The commands redundancy and axes, from end to end."""

import json

import pytest
from refusals import mentions

TURNING = """name = "two turns"
convention = "craig"
[[joint]]
limits = [-2.0, 2.0]
[[joint]]
alpha = {alpha}
limits = [-2.0, 2.0]
[tool]
xyz = [0.3, 0.1, 0.05]
"""


def test_axes_come_from_circles(run, refused, tmp_path):
    """Joint 2's axis leans by 0.1° in the actual arm; its circle says so, and that it is where it was."""
    (tmp_path / "nominal.toml").write_text(TURNING.format(alpha=1.5707963267948966))
    (tmp_path / "leaning.toml").write_text(TURNING.format(alpha=1.5707963267948966 + 0.0017453292519943296))
    options = ("simulate", "--of", "leaning.toml", "--poses", 40, "--index", "circle-points", "--seed", 2)
    assert run(*options, "--robot", "nominal.toml", "--instrument", "ideal", "--out", "c.csv")[0] == 0
    status, out, err = run("axes", "c.csv", "--robot", "nominal.toml", "--json", "a.json")
    assert status == 0, err
    assert "tilted by" in out
    first, second = json.loads((tmp_path / "a.json").read_text())["axes"]
    assert first["angle_deg"] < 1e-6
    assert second["angle_deg"] == pytest.approx(0.1, abs=1e-6)
    refused(["nothing.csv"], "axes", "nothing.csv", "--robot", "nominal.toml", status=1)


def test_redundant_constants_are_named(run, tmp_path):
    status, out, _ = run("redundancy", "--robot", "katana450-three-rotation", "--free", "--json", "r.json")
    assert status == 0
    assert mentions(out, 12, 11)
    found = json.loads((tmp_path / "r.json").read_text())
    assert found["redundant"] == ["joint5.theta"]
    assert set(found["combinations"][0]["names"]) == {"joint4.beta", "joint5.theta"}
    status, out, _ = run("redundancy", "--robot", "aria", "--frames")
    assert status == 0
    assert mentions(out, 30)
