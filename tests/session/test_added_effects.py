"""Effects that something beside the joint positions drives: found, added and compared in the app."""

import csv
import io
import zipfile

import numpy as np
import pytest
from driven_effects import driven_file
from slow import slow

from workbench import evaluate, read_measurements
from workbench.identification.run import judge
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify, LeaveRowsOut
from workbench.session.comparison import STAGES
from workbench.session.export import next_poses_csv, report_zip
from workbench.session.stages import stages


@pytest.mark.parametrize("driver", ["direction", *map(slow, ("payload", "temperature", "time"))])
def test_what_was_found_is_added_and_compared_as_evaluate_does(driver, do, tmp_path):
    path, name = driven_file(driver, tmp_path)
    session = do(LoadData(path.name, path.read_bytes()), Identify(), Diagnose(), AddEffects())
    assert [effect.name for effect in session.results.accepted] == [name], session.page.messages
    rows = session.results.comparison
    assert rows.stages == STAGES
    judged = rows.held_out if rows.held_out.any() else ~rows.held_out
    nominal, geometry, causes = 1e3 * rows.stage_errors[judged].mean(0)
    assert nominal > geometry > causes
    assert geometry == pytest.approx(session.results.geometry.judged.position_mm.mean, rel=1e-9)
    assert causes == pytest.approx(session.results.diagnosis.after.judged.position_mm.mean, rel=1e-9)
    lines = list(csv.reader(next_poses_csv(session)[1].decode().splitlines()))
    assert lines[0] == [*(f"q{k}[deg]" for k in range(1, 7)), "tells"]
    written = np.deg2rad(np.array(lines[1:])[:, :6].astype(float))
    assert written == pytest.approx(session.results.diagnosis.measure_next, abs=1e-5)
    report = zipfile.ZipFile(io.BytesIO(report_zip(session)[1])).read("report/report.html").decode()
    assert session.results.diagnosis.causes[0].label in report
    assert judge(session.results.identification.best, session.choices.wanted).verdict in report
    run = session.results.identification.runs[session.results.fit]
    diagnosed = session.results.diagnosis.robot
    assert (run.calibrated.elements, run.calibrated.effects) == (diagnosed.elements, diagnosed.effects)
    expected = evaluate(run.before_refit, read_measurements(path))
    errors = rows.stage_errors[:, 2]
    place = {int(number): i for i, number in enumerate(expected.data.row)}
    by_row = expected.errors.position[[place[int(number)] for number in rows.number]]
    assert len(rows) == len(expected.data.row) == 90
    np.testing.assert_allclose(errors, by_row, atol=1e-12)
    assert 1e3 * errors[rows.held_out].mean() == pytest.approx(run.held_out.position_mm.mean, rel=1e-9)
    saved = evaluate(run.calibrated, read_measurements(path)).errors
    assert saved.position_mm.rms < expected.errors.position_mm.rms
    if name == "joint-compliance":
        assert (1e3 * errors.mean(), 1e3 * errors.max()) == pytest.approx((0.0746, 0.1347), rel=5e-3)
    again = do(Identify()).results.identification  # the same nominal arm, and the same model
    assert again.nominal.judged.position_mm.mean == pytest.approx(nominal, rel=1e-6)
    assert again.best.judged.position_mm.mean == pytest.approx(run.judged.position_mm.mean, rel=0.05)
    session = do(LeaveRowsOut((out := int(again.train_rows[0]),)), Identify())  # what was added stays in
    rows, alone = session.results.comparison, session.results.geometry
    assert [row for row, _ in session.results.identification.excluded] == [out]
    assert alone.fit.problem.data.row.tolist() == session.results.run.fit.problem.data.row.tolist()
    assert 1e3 * rows.stage_errors[rows.held_out, 1].mean() == pytest.approx(stages(session)[1].error)
