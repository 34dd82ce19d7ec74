"""Options that the Katana work asks for, from end to end: levels, influence."""

import json

import pytest

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


@pytest.fixture
def rows(run):
    words = ("simulate", "--robot", "katana450", "--poses", 60, "--index", "iso-cube", "--seed", 3)
    assert run(*words, "--out", "d.csv")[0] == 0
    return "d.csv"


def identified(run, tmp_path, *words):
    status, out, err = run("identify", "d.csv", "--robot", "katana450", *words, "--json", "r.json")
    assert status == 0, err
    return json.loads((tmp_path / "r.json").read_text())["algorithms"], out


def test_level_1_frees_the_offsets_alone(run, tmp_path, rows):
    """Offsets alone leave most of an error that the whole geometry removes."""
    offsets, _ = identified(run, tmp_path, "--level", 1, "--algorithm", "ols")
    whole, _ = identified(run, tmp_path, "--level", 2, "--algorithm", "ols")
    assert [p["name"] for p in offsets["ols"]["parameters"]] == [f"joint{i}.theta" for i in range(1, 6)]
    errors = [found["ols"]["held_out"]["position_mm"]["mean"] for found in (offsets, whole)]
    assert errors[0] > 10.0 * errors[1]
    status, _, err = run("identify", rows, "--robot", "katana450", "--level", 1, "--free", "joint1.theta")
    assert status == 64
    assert "--level 1" in err


@pytest.mark.parametrize("instrument", ["laser-tracker-fixed", "inclinometer", "plane-probe"])
def test_instruments_are_chosen_by_name(run, tmp_path, instrument):
    words = ("simulate", "--robot", "katana450", "--poses", 80, "--index", "circle-points", "--out", "i.csv")
    status, out, _ = run(*words, "--instrument", instrument)
    assert status == 0
    assert "80 rows" in out
    head = (tmp_path / "i.csv").read_text().splitlines()[0]
    wanted = {"laser-tracker-fixed": "x[m]", "inclinometer": "tilt_x2[rad]", "plane-probe": "contact"}
    assert wanted[instrument] in head


def test_influence_is_an_algorithm(run, tmp_path, rows):
    found, out = identified(run, tmp_path, "--algorithm", "ols,influence")
    assert set(found) == {"ols", "influence"}
    assert "INFLUENCE" in out
    assert found["influence"]["converged"]
    everything, _ = identified(run, tmp_path, "--algorithm", "all")
    assert set(everything) == {"ols", "opt1", "opt2", "influence"}
    usual, _ = identified(run, tmp_path)
    assert set(usual) == {"ols", "opt1", "opt2"}


def test_axes_come_from_circles(run, tmp_path):
    """Joint 2's axis leans by 0.1° in the actual arm; its circle says so, and that it is where it was."""
    (tmp_path / "nominal.toml").write_text(TURNING.format(alpha=1.5707963267948966))
    (tmp_path / "leaning.toml").write_text(TURNING.format(alpha=1.5707963267948966 + 0.0017453292519943296))
    words = ("simulate", "--of", "leaning.toml", "--poses", 40, "--index", "circle-points", "--seed", 2)
    assert run(*words, "--robot", "nominal.toml", "--instrument", "ideal", "--out", "c.csv")[0] == 0
    status, out, err = run("axes", "c.csv", "--robot", "nominal.toml", "--json", "a.json")
    assert status == 0, err
    assert "tilted by" in out
    first, second = json.loads((tmp_path / "a.json").read_text())["axes"]
    assert first["angle_deg"] < 1e-6
    assert second["angle_deg"] == pytest.approx(0.1, abs=1e-6)
    status, _, err = run("axes", "nothing.csv", "--robot", "nominal.toml")
    assert status == 1
    assert "nothing.csv" in err


def test_redundant_constants_are_named(run, tmp_path):
    status, out, _ = run("redundancy", "--robot", "katana450-three-rotation", "--free", "--json", "r.json")
    assert status == 0
    assert "12 constants, 11 independent" in out
    found = json.loads((tmp_path / "r.json").read_text())
    assert found["redundant"] == ["joint5.theta"]
    assert set(found["combinations"][0]["names"]) == {"joint4.beta", "joint5.theta"}
    status, out, _ = run("redundancy", "--robot", "aria", "--frames")
    assert status == 0
    assert "complete model with base and tool has 30" in out
