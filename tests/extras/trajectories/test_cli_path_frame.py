"""A path's own file is read in the frame that it names: `evaluate` found 216 mm between the two frames."""

import json

POINTS = ("0.1,-0.3,0.1392893", "0,-0.3707107,0.21", "-0.1,-0.3,0.1392893")


def test_a_path_is_evaluated_where_it_was_planned(run, tmp_path):
    through = [word for point in POINTS for word in ("--through", point)]
    assert run("path", "circle", "--robot", "katana450", *through, "--out", "circle.csv")[0] == 0
    head = (tmp_path / "circle.csv").read_text(encoding="utf-8").splitlines()
    assert "pose_frame" in head[0]
    assert "base" in head[1]
    assert run("evaluate", "circle.csv", "--robot", "katana450", "--json", "e.json")[0] == 0
    errors = json.loads((tmp_path / "e.json").read_text(encoding="utf-8"))["errors"]
    assert errors["position_mm"]["max"] < 1e-3
