"""Measurements, identification, comparison and export, as commands."""

import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from driven_effects import tracked_file

from tests.session.direct_commands import done
from workbench import Motion, load_robot, read_measurements, tool_poses
from workbench.arm.robot_toml import read_toml
from workbench.base import se3
from workbench.base.assets import assets
from workbench.data.simulation.simulate import virtual_arm
from workbench.session import replay
from workbench.session.commands.compare import SetOverlay, ShowRow
from workbench.session.commands.data import ForgetData, LoadData, MeasureVirtualArm, load_command
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.drag import MoveTarget
from workbench.session.commands.identify import Identify, LeaveRowsOut, SetLevelled
from workbench.session.commands.undo import Redo, Undo
from workbench.session.comparison import Overlay
from workbench.session.export import calibrated_toml, measurements_csv
from workbench.session.state import Focus
from workbench.views.page.panels.columns import understood_as, with_column
from workbench.views.page.panels.compare import numbers
from workbench.views.page.panels.fit import _warnings


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


@pytest.mark.parametrize("heading", ["Nr", "Point"])
def test_a_file_is_read_identified_and_looked_at(do, file, heading):
    numbered = zip(file.splitlines(), [heading.encode(), *(b"%d" % k for k in range(101, 151))], strict=True)
    session = do(LoadData("../../etc/a.csv", b"\n".join(b"%s,%s" % pair for pair in numbered)))
    loaded = session.measurements.loaded
    assert loaded.name == "a.csv"
    bare = replace(loaded.file.preview, columns=[replace(c, cells=()) for c in loaded.file.preview.columns])
    assert replace(loaded, file=replace(loaded.file, preview=bare)).row_name(3) == "3"
    assert do(LeaveRowsOut((3,)), Undo()).measurements.left_out == frozenset()
    assert dict(session.measurements.loaded.facts)["Measured"] == "position, rotation"
    session = do(Identify(("ols",), 0.2), ShowRow(17), SetOverlay(Overlay(arrows=False, exaggeration=200.0)))
    found = replace(session.results.identification, excluded=((3, "odd"), (5, "odd")))
    assert f"data rows {heading} 104 (odd), {heading} 106 (odd)" in _warnings(found, session)
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
