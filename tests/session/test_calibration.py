"""Measurements, identification, comparison and export, as commands."""

import csv
import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from driven_effects import driven_file, tracked_file
from slow import slow

from tests.session.direct_commands import done
from workbench import Motion, evaluate, load_robot, read_measurements, tool_poses
from workbench.arm.robot_toml import read_toml
from workbench.base import se3
from workbench.base.assets import assets
from workbench.data.simulation.simulate import virtual_arm
from workbench.identification.run import judge
from workbench.session import replay
from workbench.session.commands.arm import JogTo
from workbench.session.commands.compare import SetOverlay, ShowRow
from workbench.session.commands.data import ForgetData, LoadData, MeasureVirtualArm, load_command
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.identify import Identify, LeaveRowsOut, SetLevelled
from workbench.session.commands.undo import Redo, Undo
from workbench.session.comparison import STAGES, Overlay
from workbench.session.export import calibrated_toml, measurements_csv, next_poses_csv, report_zip
from workbench.session.next_step import next_step
from workbench.session.page_state import Severity
from workbench.session.stages import stages
from workbench.session.state import Focus
from workbench.views.page.panels.data import understood_as, with_column
from workbench.views.page.panels.fit import _warnings
from workbench.views.page.panels.row_errors import numbers


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> bytes:
    robot, rng = load_robot("aria"), np.random.default_rng(8)
    actual = virtual_arm(robot, rng=rng, errors=(1e-3, 0.01))
    path = tmp_path_factory.mktemp("data") / "a.csv"
    return tracked_file(actual, path, rng, rows=50, reach=2.5).read_bytes()


def test_before_a_fit_rows_of_a_tracker_elsewhere_lie_where_the_arm_reached_them(do, tmp_path):
    """Its frame stands 5 m away and turned; nobody has identified the base yet."""
    robot, rng = load_robot("aria"), np.random.default_rng(9)
    actual, q = virtual_arm(robot, rng=rng, errors=(1e-3, 0.01)), rng.uniform(-1.2, 1.2, (30, 6))
    there = se3.pose(se3.rotvec_to_matrix(np.array([0.3, -0.2, 1.9])), np.array([4.0, -3.0, 1.0]))
    places = se3.apply(there, tool_poses(actual, Motion(q))[:, :3, 3])
    lines = [",".join([*(f"q{k}[rad]" for k in range(1, 7)), "x[m]", "y[m]", "z[m]"])]
    lines += [",".join(map(repr, row)) for row in np.hstack([q, places]).tolist()]
    rows = do(LoadData("far.csv", "\n".join(lines).encode())).results.comparison
    assert np.linalg.norm(rows.measured - rows.nominal[:, :3, 3], axis=1).max() < 0.03


def test_a_virtual_arm_is_recovered(worker, do, first, tmp_path):
    assert do(JogTo((9.0, 0.0, 0.0), (0.0, 0.0, 0.0))).page.messages[-1].severity is Severity.WARNING
    session = do(MeasureVirtualArm(3))
    assert session.measurements.loaded.virtual
    assert len(session.results.comparison) == 10 + 40
    assert set(do(Identify()).results.identification.runs) == {"ols"}
    session = do(Identify(("ols", "opt1", "opt2")))
    found = session.results.identification
    assert len(found.held_out_data) == 40
    assert found.runs["opt2"].held_out.position_mm.mean < 0.02 * found.nominal.held_out.position_mm.mean
    assert session.playback.focus is Focus.ROW
    assert session.results.comparison.held_out.tolist() == [False] * 10 + [True] * 40
    before, after = session.results.comparison.stage_errors[10:50, :2].T
    assert 1e3 * before.mean() == pytest.approx(found.nominal.held_out.position_mm.mean)
    assert 1e3 * after.mean() == pytest.approx(found.runs[session.results.fit].held_out.position_mm.mean)
    again = replay(first, worker.journal)
    assert Severity.WARNING not in [m.severity for m in (*session.page.messages, *again.page.messages)]
    assert np.array_equal(again.results.identification.runs["ols"].fit.x, found.runs["ols"].fit.x)

    name, content = calibrated_toml(session)
    (tmp_path / name).write_bytes(content)
    wanted = found.runs["opt2"].calibrated.values(first.robot.default_free)
    assert np.allclose(read_toml(tmp_path / name).values(first.robot.default_free), wanted, atol=1e-12)
    name, content = measurements_csv(session)
    (tmp_path / name).write_bytes(content)
    assert len(read_measurements(tmp_path / name, joints=6)) == 10


def test_a_second_file_puts_a_calibration_aside_and_undo_which_says_so_restores_it(do, file):
    before = do(LoadData("one.csv", file), Identify(("opt2",)))
    assert do(Undo()).results.identification is None
    assert do(Redo()).results.identification is before.results.identification
    assert "one.csv" in LoadData("two.csv", file).removes(before)
    rows = before.measurements.loaded
    demo = replace(rows, file=replace(rows.file, content=(assets() / "samples" / "ur10.csv").read_bytes()))
    assert not LoadData("two.csv", file).removes(before.updated("measurements", loaded=demo))
    for other in (LoadData("two.csv", file), MeasureVirtualArm(3), ForgetData()):
        session = do(other)
        assert session.results.identification is None
        assert session.history.done[-1].by == other.title
        back = do(Undo())
        assert back.measurements.loaded is before.measurements.loaded
        assert back.results.identification is before.results.identification


@pytest.mark.parametrize(("heading", "word"), [("Nr", ""), ("Point", ""), ("Point", "P")])
def test_a_file_is_read_identified_and_looked_at(do, file, heading, word):
    cells = (f"{word}{k}".encode() for k in range(101, 151))
    numbered = zip(file.splitlines(), [heading.encode(), *cells], strict=True)
    session = do(LoadData("../../etc/a.csv", b"\n".join(b"%s,%s" % pair for pair in numbered)))
    loaded = session.measurements.loaded
    assert loaded.name == "a.csv"
    bare = replace(loaded.file.preview, columns=[replace(c, cells=()) for c in loaded.file.preview.columns])
    assert replace(loaded, file=replace(loaded.file, preview=bare)).row_name(3) == "3"
    assert do(LeaveRowsOut((3,)), Undo()).measurements.left_out == frozenset()
    assert dict(session.measurements.loaded.facts)["Measured"] == "position, rotation"
    session = do(Identify(("ols",), 0.2), ShowRow(17), SetOverlay(Overlay(arrows=False, exaggeration=200.0)))
    found = replace(session.results.identification, excluded=((3, "odd"), (5, "odd")))
    name = word or f"{heading} "
    assert f"data rows {name}104 (odd), {name}106 (odd)" in _warnings(found, session)
    said = "between rows 3 and 4; joints 2, 3, 4 (all), 3 rows, rows 3–5, 7 (0.1, 2 mm) (rows count from 0)"
    assert session.measurements.named(said) == (
        f"between rows {name}104 and {name}105; joints 2, 3, 4 (all), 3 rows, "
        f"rows {name}104–{name}106, {name}108 (0.1, 2 mm)"
    )
    assert set(numbers(session)) == set(range(101, 151))
    assert len(found.held_out_rows) == 10
    assert (session.results.row, session.playback.focus, session.results.fit) == (17, Focus.ROW, "ols")
    assert not session.choices.overlay.arrows
    session = do(MoveTarget(0, (0.5, 0.3, 0.25), (-2.6, 0.0, 0.0)))
    assert session.playback.focus is Focus.TARGET
    assert session.results.identification is not None
    session = do(ForgetData())
    assert session.measurements.loaded is session.results.identification is session.results.comparison is None


def test_without_an_effect_the_arm_of_the_diagnosis_is_saved(do, file):
    before = do(LoadData("a.csv", file), Identify())
    session = do(Diagnose())
    assert any("refitted to all 50 rows" in note for note in session.results.diagnosis.notes)
    assert session.results.run is session.results.diagnosis.after
    assert do(Undo()).results.run is before.results.run


def test_columns_without_units_are_shown_and_one_choice_mends_them(do, file):
    """Too few rows tell none."""
    file = b"".join(file.splitlines(keepends=True)[:6])
    bare = file.replace(b"[rad]", b"", 6)
    session = do(LoadData("bare.csv", bare))
    kept = session.measurements.unread
    assert session.measurements.loaded is None
    assert "unit is missing" in kept.preview.problems[0]
    assert [(c.heading, c.key, c.si) for c in kept.preview.columns[:2]] == [
        ("q1", "q1", None),
        ("q2", "q2", None),
    ]
    session = do(LoadData("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(50)))
    assert session.measurements.unread.name == "picture.png"  # no more what was before
    assert "columns" not in next_step(session).sentence + session.page.messages[-1].text
    gap = b"q2[rad],q3[rad],q4[rad],q5[rad],q6[rad],x[m],y[m],z[m]\n" + b"0," * 7 + b"1\n"
    assert "column of joint 1" in do(LoadData("gap.csv", gap)).page.messages[-1].text
    columns = with_column(understood_as(kept.preview), "q1", "q1[rad]")
    session = do(LoadData(kept.name, kept.content, json.dumps(columns)))
    assert session.measurements.unread is None
    assert np.array_equal(
        session.measurements.loaded.dataset.q, do(LoadData("a.csv", file)).measurements.loaded.dataset.q
    )
    swapped = with_column(with_column(columns, "x[m]", "y[m]"), "y[m]", "x[m]")
    there, here = (
        do(LoadData(kept.name, kept.content, json.dumps(swapped))).measurements.loaded.dataset,
        session.measurements.loaded.dataset,
    )
    assert np.array_equal(there.position, here.position[:, [1, 0, 2]])


def test_a_packed_table_is_read_as_it_is(file, tmp_path):
    (tmp_path / "a.csv").write_bytes(file)
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.write(tmp_path / "a.csv", "a/a.csv")
    assert load_command("a.zip", (tmp_path / "a.zip").read_bytes()) == LoadData("a.csv", file)


def test_fits_know_whether_the_instrument_is_levelled(first):
    session = done(first, MeasureVirtualArm(3, more=20))
    assert np.sort(session.results.comparison.number).tolist() == list(range(70))  # no number is left out
    for levelled in (False, True):
        found = done(session, SetLevelled(levelled), Identify(("opt2",)), Diagnose())
        assert found.results.identification.best.fit.problem.frames.levelled is levelled
        assert found.results.diagnosis.after.fit.problem.frames.levelled is levelled


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
