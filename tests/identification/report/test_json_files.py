import json

import pytest

from workbench.identification.report.results_json import evaluation_json, identification_json
from workbench.report.json import json_text

ERRORS = {"position_mm", "orientation_deg"}
SPREAD = {"mean", "rms", "max", "median"}


def check_errors(errors, turned):
    assert set(errors) == ERRORS
    assert set(errors["position_mm"]) == SPREAD
    assert (errors["orientation_deg"] is not None) == turned
    if turned:
        assert set(errors["orientation_deg"]) == SPREAD


def test_the_schema_of_an_identification(result):
    found = json.loads(json_text(identification_json(result)))
    assert found["schema"] == "workbench.identification/1"
    assert found["robot"] == result.robot.name
    rows = found["measurements"]
    assert (rows["used"], rows["held_out"]) == (len(result.train_rows), len(result.held_out_data))
    assert rows["excluded"] == [{"row": 3, "reason": "<b>probe</b>"}]
    check_errors(found["nominal"]["train"], True)
    check_errors(found["nominal"]["held_out"], True)
    assert set(found["algorithms"]) == {"ols", "opt2"}
    for name, run in found["algorithms"].items():
        fit = result.runs[name].fit
        check_errors(run["train"], True)
        check_errors(run["held_out"], True)
        assert run["converged"] is True
        assert isinstance(run["iterations"], int)
        assert run["seconds"] > 0.0
        assert [p["name"] for p in run["parameters"]] == list(fit.problem.names)
        assert all(set(p) == {"name", "unit", "nominal", "value", "std"} for p in run["parameters"])
        assert [p["value"] for p in run["parameters"]] == fit.x.tolist()
        assert [p["std"] for p in run["parameters"]] == fit.std.tolist()
        assert {p["unit"] for p in run["parameters"]} == {"rad", "m"}
    assert found["unidentifiable"] == list(result.unidentifiable)
    assert found["warnings"] == list(result.warnings)
    mean = result.runs["ols"].held_out.position_mm.mean
    assert found["algorithms"]["ols"]["held_out"]["position_mm"]["mean"] == mean


def test_points_without_held_out_rows(points):
    found = json.loads(json_text(identification_json(points)))
    check_errors(found["nominal"]["train"], False)
    assert found["nominal"]["held_out"] is None
    assert found["measurements"]["held_out"] == 0
    assert found["unidentifiable"]
    std = {p["name"]: p["std"] for p in found["algorithms"]["ols"]["parameters"]}
    for combination in points.best.fit.unidentifiable:
        if len(combination.names) == 1:  # no row shows it: its standard error would mean nothing
            assert std[combination.names[0]] is None


def test_the_schema_of_an_evaluation(evaluated):
    found = json.loads(json_text(evaluation_json(evaluated)))
    assert found["schema"] == "workbench.evaluation/1"
    check_errors(found["errors"], True)
    assert [row["row"] for row in found["rows"]] == list(range(12))
    assert all(set(row) == {"row", "position_mm", "orientation_deg"} for row in found["rows"])
    assert found["rows"][5]["position_mm"] == pytest.approx(1e3 * evaluated.errors.position[5])
