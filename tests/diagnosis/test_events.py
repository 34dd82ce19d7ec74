"""What happened while an arm was measured: named with its row, and the saved arm is the one afterwards."""

import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import round_trip
from problems import slopes
from refusals import mentions

from tests.session.direct_commands import done
from workbench.arm.built_in_arms import load_robot
from workbench.arm.effects import EFFECTS
from workbench.arm.motion import Motion
from workbench.base.errors import OptionError
from workbench.base.wording import plural
from workbench.data.prediction import row_components
from workbench.data.writer import write_measurements
from workbench.diagnosis.claims.structure import structure_of
from workbench.diagnosis.diagnose import diagnose
from workbench.diagnosis.report.results_json import diagnosis_json
from workbench.diagnosis.search import rounds
from workbench.diagnosis.search.candidates import catalogue
from workbench.diagnosis.search.event_search import changeable, promising
from workbench.diagnosis.search.evidence import left_by, offer
from workbench.diagnosis.search.gram_matrices import compress
from workbench.diagnosis.search.timeline import Timeline, crowded
from workbench.identification.errors.file_errors import file_text, refitted_errors
from workbench.identification.errors.saved_arm import SavedArm
from workbench.identification.evaluate import evaluate
from workbench.identification.identify import identify
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.identify import Identify
from workbench.session.start import default_plate, start

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from events import CASES, NEAR, judge, make


@cache
def diagnosed(name, held_out=0.2):
    """An arm to which this happened, and its diagnosis."""
    made = make(CASES[name], 0, "aria")
    return made, diagnose(made.robot, made.data, held_out=held_out)


@pytest.fixture
def slipped():
    """An arm whose reflector slipped half-way."""
    return diagnosed("slip")


@pytest.mark.parametrize(
    "name",
    ["knock", "zero", "warm-joint", "warm-frame", "two", "late-slip", "shuffled", "untimed", "slip-pose"],
)
def test_an_event_is_named_with_its_row_and_nothing_else(name):
    found = judge(name, 1)
    assert found["right"], found["message"]
    assert not found["false"], found["message"]


@pytest.mark.parametrize("seed", [1, 4])
@pytest.mark.parametrize("name", ["knock-known", "slip-known"])
def test_a_base_or_a_tool_that_was_known_until_it_moved(name, seed):
    """As if it were known afterwards, another step at the end took its place, and it drifted in between."""
    found = judge(name, seed)
    assert found["right"], found["message"]
    assert not found["false"], found["message"]


@pytest.mark.parametrize("name", ["knock-known", "slip-known"])
def test_a_base_or_a_tool_that_is_known_since_it_moved(name):
    """As if it were known until then, a second step among the first rows was certain."""
    made = make(CASES[name], 1, "aria")
    backwards = replace(made.data, time=made.data.time.max() - made.data.time)
    (cause,) = diagnose(made.robot, backwards, held_out=0.2).causes
    assert cause.kind == made.truth[0].kind
    assert abs(cause.row - (made.truth[0].row - 1)) <= NEAR


@pytest.mark.parametrize(("name", "seed"), [("zero", 910003), ("slip-markers", 0), ("slip-markers", 3)])
def test_an_event_is_named_where_joints_scatter_and_where_places_on_the_tool_are_unknown(name, seed):
    """A step no larger than ten times what its joint scatters was called a residual map."""
    found = judge(name, seed)
    assert found["right"], found["message"]
    assert not found["false"], found["message"]


@pytest.mark.parametrize("name", ["drift", "untimed-drift", "none", "none-tails", "none-compliance"])
def test_where_nothing_happened_no_event_is_named(name):
    found = judge(name, 2)
    assert found["right"]
    assert not found["false"], found["message"]


@pytest.mark.parametrize(("order", "doubted"), [("chance", False), ("raster", False), ("elsewhere", True)])
def test_a_step_is_doubted_where_postures_change_for_good_at_its_row(order, doubted):
    """The last eight postures of a Panda were far from all others: joint 1 was said to have stepped there."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.0, 1.0, (120, 6))
    if order == "raster":
        q = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, 5)] * 3, indexing="ij"), -1).reshape(-1, 3)
    if order == "elsewhere":
        q[112:, :2] += 2.0
    step = EFFECTS["zero-step"]((0,), row=112)
    assert (step.doubt(Motion(q, row=np.arange(len(q)))) is not None) is doubted


def test_an_event_that_postures_may_explain_is_not_taken(monkeypatch):
    made = make(CASES["zero"], 1, "three-parallel")
    monkeypatch.setattr(EFFECTS["zero-step"], "doubt", lambda self, motion: "postures differ")
    assert not [e for e in diagnose(made.robot, made.data, held_out=0.2).events if e.name == "zero-step"]


def test_an_event_says_row_time_and_size(slipped):
    made, found = slipped
    (cause,) = found.causes
    (truth,) = made.truth
    assert abs(cause.row - truth.row) <= NEAR
    assert "±" in cause.sentence
    written = diagnosis_json(found)
    (result,) = written["causes"]
    assert (result["kind"], result["joints"], result["row"]) == ("tool-step", [], cause.row)
    assert result["time_s"] == made.data.time[cause.row]
    assert [e["name"] for e in written["effects"]] == ["tool-step"]


@pytest.mark.parametrize("name", ["slip", "slip-known", "knock-known"])
def test_the_saved_arm_is_the_one_afterwards(name, tmp_path):
    """The file alone, read by a stranger, gives the stated number on the rows after the event."""
    made, found = diagnosed(name)
    found.calibrated.save(tmp_path / "arm.toml")
    write_measurements(made.data, tmp_path / "rows.csv")
    rows = round_trip.read_rows(tmp_path / "rows.csv")
    used = np.setdiff1d(np.arange(found.now.row, len(rows)), found.data.row[found.outliers])
    used = np.setdiff1d(used, [row for row, _ in found.excluded])
    arm = round_trip.read_arm(tmp_path / "arm.toml")
    assert 1e3 * round_trip.errors(arm, rows.take(used)).position == pytest.approx(
        found.now.mean_mm, rel=1e-4
    )
    before = rows.take(np.arange(found.now.row - NEAR - 1))
    assert 1e3 * round_trip.errors(arm, before).position > 4.0 * found.now.mean_mm
    assert not found.calibrated.effects


def left_by_files(arm, data, folder):
    """Position errors [mm] that an arm's files leave in every row, by other code."""
    paths = [Path(arm.save(folder / f"arm.{kind}")) for kind in ("toml", "urdf")]
    saved = round_trip.Saved(*paths, "", np.zeros(0), None)
    rows = round_trip.read_rows(write_measurements(data, folder / "rows.csv"))
    return {
        path.suffix[1:].upper(): 1e3
        * np.linalg.norm(saved.arm(path)(rows)[1][:, :3, 3] - rows.position, axis=1)
        for path in paths
    }


def since(found, data):
    """Whether a row was measured after all that happened."""
    clock = data.row if data.time is None else data.time
    return clock >= max(clock[data.row == e.row][0] for e in found.final_fit.arm.effects if e.is_event)


@pytest.mark.parametrize(
    ("name", "held_out"),
    [*((name, 0.2) for name in ("slip", "warm-frame", "two", "slip-known", "slip-pose")), ("two", 0.0)],
)
def test_what_is_stated_of_the_files_is_what_they_leave(name, held_out, tmp_path):
    """The arm with its events was stated: 0.045 mm with a warm-up of the frame where its file left 0.049."""
    made, found = diagnosed(name, held_out)
    run = found.identification().best
    stated, left = refitted_errors(run) or run.file_errors, left_by_files(found.robot, made.data, tmp_path)
    shown = np.isin(made.data.row, run.fit.problem.data.row) & since(found, made.data)
    assert 0 < shown.sum() < len(run.fit.problem.data)
    for form, errors in stated.items():
        assert errors.position_mm.mean == pytest.approx(left[form][shown].mean(), abs=1e-6)
    assert found.now.mean_mm == found.saved_errors.position_mm.mean == stated["TOML"].position_mm.mean
    assert f"{shown.sum()} of {plural(len(run.fit.problem.data), 'fitted row')}" in file_text(run)
    judged, numbers = SavedArm(run.as_measured, run.fit.problem.data).robot, run.judging.row
    left = left_by_files(judged, made.data, tmp_path)["TOML"]
    shown = np.isin(made.data.row, numbers) & since(found, made.data)
    assert 1e3 * found.robot.calibration.error.position == pytest.approx(left[shown].mean(), abs=1e-6)


def test_a_search_over_all_places_is_a_fit_at_each():
    """Its best place and evidence are those of columns that are differentiated and fitted one by one."""
    made = make(CASES["zero"], 1, "katana")
    stage = rounds.geometry_first(
        diagnose(made.robot, made.data, held_out=0.0).before_fit.problem.without_deviation()
    )
    fold, problem = np.arange(len(made.data)) % 5, stage.problem
    kinds, line = changeable(problem), Timeline.of(problem.data)
    grams = compress(problem, stage.fit.x, [], fold, changed=[k.event for k in kinds], pieces=line.piece)
    joint = made.truth[0].joint
    best = next(
        c for c in promising(grams, (), line, kinds) if c.effect.joints == (joint,) and c.effect.is_step
    )
    squares = {}
    at = problem.named(stage.fit.x)
    jacobian = problem.jacobian(stage.fit.x)
    residual = problem.residual(stage.fit.x)
    for row in range(3, len(made.data) - 3):
        effect = EFFECTS["zero-step"]((joint,), row=row)
        column = slopes(replace(problem, prior=None, prior_centre=None, deviation=None), [effect], at)
        column = np.concatenate([column, np.zeros((len(residual) - len(column), 1))])
        wide = np.column_stack([jacobian, column])
        left = residual - wide @ np.linalg.lstsq(wide, residual, rcond=1e-12)[0]
        squares[row] = float(left @ left)
    assert best.effect.row == min(squares, key=squares.get)
    alone = compress(problem, stage.fit.x, [best.effect], fold)
    gain = offer(left_by(alone, ()), best).gain
    before = left_by(alone, ()).square
    expected = 0.5 * left_by(alone, ()).freedom * np.log(before / squares[best.effect.row])
    expected -= 0.5 * np.log(problem.count) + np.log(best.tries)
    assert gain == pytest.approx(expected, rel=0.02)


def test_pieces_of_many_rows_come_down_to_single_rows_about_an_event():
    made = make(CASES["none"], 0, "aria")
    rows = made.data.take(np.arange(1200) % len(made.data))
    rows = replace(rows, time=np.arange(1200.0), row=np.arange(1200))
    coarse, fine = Timeline.of(rows), Timeline.of(rows, [613.0])
    assert coarse.piece.max() < 240
    assert (np.bincount(fine.piece)[fine.piece[610:616]] == 1).all()


def test_rows_that_stand_out_together_are_no_outliers_yet():
    made = make(CASES["none"], 0, "aria")
    marked = np.zeros(120, bool)
    marked[[5, 40, 110, 111, 113, 115]] = True
    assert np.flatnonzero(crowded(marked, made.data, within=7, fewest=3)).tolist() == [110, 111, 113, 115]


def test_what_a_slip_leaves_steps_in_the_order(slipped):
    made, found = slipped
    left = structure_of(found.before_fit, np.random.default_rng(0))
    assert left.step is not None
    assert abs(left.step[1] - made.truth[0].row) <= NEAR
    assert not structure_of(found.after_fit, np.random.default_rng(0)).found


def test_offers_of_a_catalogue_hold_no_events():
    """Where to try them, only the rows say."""
    made = make(CASES["none"], 0, "aria")
    assert not any(c.effect.is_event for c in catalogue(made.robot, Motion.of(made.data)).candidates)


def test_exchanged_rows_are_named():
    made = make(CASES["none"], 3, "aria")
    position = made.data.position.copy()
    position[[31, 36]] = position[[36, 31]]
    found = diagnose(made.robot, replace(made.data, position=position), held_out=0.0)
    assert any("rows 31 and 36 look exchanged" in note for note in found.notes)
    assert sorted(found.data.row[found.outliers].tolist()) == [31, 36]


def test_rows_before_an_event_are_compared_with_the_arm_of_their_time(slipped, tmp_path):
    """An identification after the event was added drew them millimetres off: by the arm as it is now."""
    made, _ = slipped
    content = write_measurements(made.data, tmp_path / "rows.csv").read_bytes()
    session = done(start(made.robot, default_plate(made.robot)), LoadData("rows.csv", content))
    rows = done(session, Diagnose(), AddEffects(), Identify()).results.comparison
    is_before = rows.number < made.truth[0].row
    before, after = (1e3 * np.nanmean(rows.errors[chosen, 1]) for chosen in (is_before, ~is_before))
    assert max(before, after) < 0.15
    assert before < 1.5 * after


@pytest.mark.parametrize("name", ["knock", "slip"])
@pytest.mark.parametrize(("frames", "moved"), [("auto", 4e-3), ("shared", 0.0)])
def test_a_session_that_was_over_before_an_event_keeps_its_frames(name, frames, moved, tmp_path):
    """Each session's frames were saved as they were after the event: off by all of it in earlier ones."""
    made = make(CASES[name], 0, "aria")
    session = np.where(np.arange(len(made.data)) < 40, "A", "B")
    position = made.data.position + moved * (session == "A")[:, None]
    data = replace(made.data, session=session, position=position)
    found = diagnose(made.robot, data, held_out=0.2, frames=frames)
    assert [c.kind for c in found.causes] == [made.truth[0].kind]
    found.calibrated.save(tmp_path / "arm.toml")
    errors = 1e3 * evaluate(load_robot(tmp_path / "arm.toml"), data).rows.position
    of_a, now = errors[:40].mean(), errors[found.now.row :].mean()
    assert max(of_a, now) < 0.1
    assert list(found.robot.sessions) == ["B", "A"], "a URDF holds the first one: the arm as it is now"
    run = found.identification().best
    fitted = np.isin(data.row, run.fit.problem.data.row) & ((session == "A") | since(found, data))
    for form, left in left_by_files(found.robot, data, tmp_path).items():
        assert refitted_errors(run)[form].position_mm.mean == pytest.approx(left[fitted].mean(), abs=1e-6)
    assert mentions(file_text(run), "session A")
    assert errors[41 : made.truth[0].row - NEAR].mean() > 4.0 * now, "they share a session with rows after it"


@pytest.mark.parametrize("name", ["none", "slip"])
def test_a_session_that_was_held_out_has_its_own_base_in_the_file(name, tmp_path):
    """All rows were fitted with one base: the file left 230 mm where the result stated 0.08."""
    made = make(CASES[name], 0, "aria")
    first = np.arange(len(made.data)) < 40
    away = made.data.position + np.outer(~first, [0.5, 0.2, 0.1])
    data = replace(made.data, session=np.where(first, "A", "B"), position=away)
    found = diagnose(made.robot, data, held_out="session:A")
    run = found.identification().best
    stated = 1e3 * found.robot.calibration.error.position
    assert stated == run.file_errors["TOML"].position_mm.mean == found.after.held_out.position_mm.mean
    left = left_by_files(found.robot, data, tmp_path)["TOML"]
    shown = np.isin(data.row, run.saved.valid_for(run.fit.problem.data).row)
    assert refitted_errors(run)["TOML"].position_mm.mean == pytest.approx(left[shown].mean(), abs=1e-6)
    assert max(stated, left[shown].mean()) < 0.1
    alone = identify(made.robot, data, held_out="session:A").best
    assert alone.file_errors["TOML"] == alone.held_out
    for judged in (run, alone):
        shown = row_components(judged.as_measured, judged.held_out_data).position
        mean = 1e3 * np.linalg.norm(shown, axis=1).mean()
        assert mean == pytest.approx(judged.held_out.position_mm.mean, rel=1e-3)


@pytest.mark.extra("reports")
@pytest.mark.parametrize("clock", ["none", "begins anew", "later"])
def test_rows_of_another_file_are_judged_by_the_arm_as_it_is_now(clock, tmp_path):
    """They were judged with the frame before the event, whose row or time their own were below."""
    case = CASES["knock"] if clock != "none" else replace(CASES["knock"], timed=False)
    made = make(case, 0, "aria")
    last = np.arange(len(made.data)) >= 90
    fitted, other = made.data.take(~last), made.data.take(last)
    other = replace(other, row=np.arange(len(other)))
    if clock == "begins anew":
        other = replace(other, time=other.time - other.time[0] + fitted.time[0])
    found = diagnose(made.robot, fitted, held_out=other)
    assert [c.kind for c in found.causes] == ["frame-step"]
    assert found.after.held_out.position_mm.mean < 0.15
    assert len(found.held_out_data) == len(other)
    left = left_by_files(found.robot, other, tmp_path)["TOML"].mean()
    stated = found.identification().best.file_errors["TOML"].position_mm.mean
    assert stated == pytest.approx(left, abs=1e-6)
    assert 1e3 * found.robot.calibration.error.position == pytest.approx(stated)
    shown = row_components(found.identification().best.as_measured, found.held_out_data).position
    assert 1e3 * np.linalg.norm(shown, axis=1).mean() == pytest.approx(found.after.held_out.position_mm.mean)
    assert all(found.plot(f"effect-{k}").axes for k in range(1, len(found.effects) + 1))


def test_rows_that_one_run_was_divided_into_are_judged_by_their_times():
    made = make(CASES["knock"], 0, "aria")
    out = np.arange(len(made.data)) % 5 == 2
    other = replace(made.data.take(out), row=np.arange(out.sum()))
    found = diagnose(made.robot, made.data.take(~out), held_out=other)
    assert found.after.held_out.position_mm.mean < 0.15
    before = other.time < made.data.time[made.truth[0].row - NEAR]
    is_over = found.events[0].is_over(Motion.of(found.held_out_data))
    assert not is_over[np.isin(found.held_out_data.time, other.time[before])].any()


@pytest.mark.extra("reports")
def test_the_report_draws_a_line_with_its_name_where_something_happened(slipped):
    made, found = slipped
    (event,) = found.events
    figure = found.plot("events")
    (axes,) = figure.axes
    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert [line.get_xdata()[0] for line in dashed] == [pytest.approx(event.time_s / 60.0)]
    assert [text.get_text().strip() for text in axes.texts] == [event.mark]
    before, after = (line.get_ydata() for line in axes.lines if line.get_linestyle() == "None")
    assert before.mean() > 3.0 * after.mean()
    again = diagnose(made.robot, made.data.take(np.arange(event.row, len(made.data))), held_out=0.0)
    with pytest.raises(OptionError):
        again.plot("events")
