import json

import pytest

from workbench.base.errors import FileError, OptionError
from workbench.identification.prior import Prior, read_prior
from workbench.identification.report.results_json import evaluation_json, identification_json
from workbench.report.json import json_text, write_json

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
        assert {p["unit"] for p in run["parameters"]} == {"rad", "m"}
    assert found["unidentifiable"] == list(result.unidentifiable)
    assert found["warnings"] == list(result.warnings)
    assert found["algorithms"]["ols"]["suspicious_rows"] == [10]
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
    assert found["rows"][5]["position_mm"] == pytest.approx(1e3 * evaluated.rows.position[5])


def test_a_result_is_prior_knowledge_of_the_arm(tmp_path, points):
    path = write_json(tmp_path / "r.json", identification_json(points))
    prior, direct = read_prior(path), Prior.of(points.best.fit)
    assert all(n.startswith("joint") for n in prior.names)
    assert "base.x" in points.best.fit.problem.names
    assert prior.names == direct.names
    assert prior.values == pytest.approx(direct.values)
    assert prior.information == pytest.approx(direct.information)
    fewer = read_prior(path, renew=(2, 3))
    assert fewer.names == tuple(n for n in prior.names if not n.startswith(("joint2.", "joint3.")))
    assert fewer.information.shape == (len(fewer.names), len(fewer.names))
    assert fewer.information == pytest.approx(direct.keep(fewer.names.__contains__).information)


def test_bad_priors(tmp_path, points):
    with pytest.raises(FileError) as error:
        read_prior(tmp_path / "none.json")
    assert error.value.path.endswith("none.json")
    uneven = '{"prior": {"names": ["joint1.d"], "values": [0], "information": [[1, 2]]}}'
    huge = '{"prior": {"names": ["a"], "values": [1' + "0" * 400 + '], "information": [[1]]}}'
    for content in ("no json", "{}", uneven, huge, "[]", "[" * 100_000):
        (tmp_path / "bad.json").write_text(content)
        with pytest.raises(FileError):
            read_prior(tmp_path / "bad.json")
    path = write_json(tmp_path / "r.json", identification_json(points))
    with pytest.raises(OptionError):
        read_prior(path, renew=(9,))
    with pytest.raises(OptionError):
        read_prior(path, renew=(1, 2, 3, 4, 5, 6))
