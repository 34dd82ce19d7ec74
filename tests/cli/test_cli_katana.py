"""Options that the Katana work asks for, from end to end: levels, influence."""

import json


def identified(run, tmp_path, *options):
    status, out, err = run("identify", "d.csv", "--robot", "katana450", *options, "--json", "r.json")
    assert status == 0, err
    return json.loads((tmp_path / "r.json").read_text())["algorithms"], out


def test_level_1_frees_the_offsets_alone(run, refused, tmp_path):
    """Offsets alone leave most of an error that the whole geometry removes."""
    options = ("simulate", "--robot", "katana450", "--poses", 60, "--index", "iso-cube", "--seed", 3)
    assert run(*options, "--out", "d.csv")[0] == 0
    offsets, _ = identified(run, tmp_path, "--level", 1, "--algorithm", "ols")
    whole, _ = identified(run, tmp_path, "--level", 2, "--algorithm", "ols")
    assert [p["name"] for p in offsets["ols"]["parameters"]] == [f"joint{i}.theta" for i in range(1, 6)]
    errors = [found["ols"]["held_out"]["position_mm"]["mean"] for found in (offsets, whole)]
    assert errors[0] > 10.0 * errors[1]
    options = ("--robot", "katana450", "--level", 1, "--free", "joint1.theta")
    refused(["--level 1"], "identify", "d.csv", *options, status=64)
