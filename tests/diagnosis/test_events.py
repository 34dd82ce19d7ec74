"""What happened while an arm was measured: named with its row, and the saved arm is the one afterwards."""

import re
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import round_trip
from problems import slopes
from refusals import mentions
from slow import slow

from workbench import Motion, diagnose, evaluate, identify, load_robot, write_measurements
from workbench.arm.effects import EFFECTS
from workbench.base.wording import plural
from workbench.data.prediction import row_components
from workbench.diagnosis.confidence import Confidence
from workbench.diagnosis.search import rounds
from workbench.diagnosis.search.event_search import Timeline, changeable, promising
from workbench.diagnosis.search.evidence import left_by, offer
from workbench.diagnosis.search.gram_matrices import compress
from workbench.identification.run import SavedArm, file_text, refitted_errors

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from events import CASES, NEAR, judge, make


@cache
def diagnosed(name, held_out=0.2):
    """An arm to which this happened, and its diagnosis."""
    made = make(CASES[name], 0, "aria")
    return made, diagnose(made.robot, made.data, held_out=held_out)


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        *(("warm-joint", 1), ("two", 1)),
        *(slow(k, 1) for k in ("knock", "untimed", "warm-frame", "late-slip", "shuffled", "slip-pose")),
        *(slow("knock-known", 1), slow("slip-known", 4)),
        slow("zero", 910003),  # no larger than ten times what its joint scatters
        slow("slip-markers", 3),  # places on the tool are unknown
    ],
)
def test_an_event_is_named_with_its_row_and_nothing_else(name, seed):
    found = judge(name, seed)
    assert found["right"], found["message"]
    assert not found["false"], found["message"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drift", "untimed-drift", "none-tails", "none-compliance"])
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


@pytest.mark.parametrize(("joint", "same"), [(0, "base or measuring frame"), slow(5, "tool")])
def test_a_zero_that_moves_all_as_a_frame_does_is_not_certain(joint, same):
    """The zero of joint 1 was 'certain' where the tripod had turned."""
    made = make(CASES["none"], 0, "three-parallel")
    q = np.array(made.data.q)
    q[60:, joint] -= 6e-3
    (cause,) = diagnose(made.robot, replace(made.data, q=q), held_out=0.2).causes
    assert (cause.kind, cause.joints, cause.confidence) == ("zero-step", (joint,), Confidence.PROBABLE)
    assert f"a {same} that turned" in cause.doubt


def test_a_temperature_that_changes_with_a_knock_does_not_hide_it():
    """'Certain' was a dependence on the temperature; no step was found, and the saved arm was the mean."""
    made = make(CASES["knock"], 0, "aria")
    warm = 20.0 + 5.0 * (np.arange(len(made.data)) >= made.truth[0].row)
    found = diagnose(made.robot, replace(made.data, temperature=warm), held_out=0.2)
    assert [c.kind for c in found.causes] == ["frame-step"]
    assert re.search(r"temperature.*, or a step between rows \d+ and \d+.*\(cannot tell\)", found.message)


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
    return clock >= max(clock[data.row == e.row][0] for e in found.after.fit.arm.effects if e.is_event)


@pytest.mark.parametrize(
    ("name", "held_out"), [("slip", 0.2), slow("warm-frame", 0.2), slow("slip-known", 0.2), slow("two", 0.0)]
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
    assert found.now.mean_mm == stated["TOML"].position_mm.mean
    assert f"{shown.sum()} of {plural(len(run.fit.problem.data), 'fitted row')}" in file_text(run)
    judged, numbers = SavedArm(run.as_measured, run.fit.problem.data).robot, run.judging.row
    left = left_by_files(judged, made.data, tmp_path)["TOML"]
    shown = np.isin(made.data.row, numbers) & since(found, made.data)
    assert 1e3 * found.robot.calibration.error.position == pytest.approx(left[shown].mean(), abs=1e-6)


def test_a_search_over_all_places_is_a_fit_at_each():
    """Its best place and evidence are those of columns that are differentiated and fitted one by one."""
    made = make(CASES["zero"], 1, "katana")
    alone = identify(made.robot, made.data, held_out=0.0).best.fit
    stage = rounds.geometry_first(alone.problem.with_deviation(None))
    fold, problem = np.arange(len(made.data)) % 5, stage.problem
    kinds, line = changeable(problem), Timeline.of(problem.data)
    grams = compress(problem, stage.fit.x, [], fold, changed=[k.event for k in kinds], pieces=line.piece)
    joint = made.truth[0].joint
    best = next(
        c for c in promising(grams, (), line, kinds) if c.effect.joints == (joint,) and c.effect.is_step
    )
    squares = {}
    at, fitted = problem.named(stage.fit.x), problem.evaluate(stage.fit.x)
    jacobian, residual = fitted.jacobian, fitted.residual
    for row in range(3, len(made.data) - 3):
        effect = EFFECTS["zero-step"]((joint,), row=row)
        column = slopes(replace(problem, knowledge=problem.knowledge[:0], deviation=None), [effect], at)
        column = np.concatenate([column, np.zeros((len(residual) - len(column), 1))])
        wide = np.column_stack([jacobian, column])
        left = residual - wide @ np.linalg.lstsq(wide, residual, rcond=1e-12)[0]
        squares[row] = float(left @ left)
    assert best.effect.row == min(squares, key=squares.get)
    alone = left_by(compress(problem, stage.fit.x, [best.effect], fold), ())
    gain = offer(alone, best).gain
    expected = 0.5 * alone.freedom * np.log(alone.square / squares[best.effect.row])
    expected -= 0.5 * np.log(problem.count) + np.log(best.tries)
    assert gain == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("name", "frames", "moved"), [("knock", "auto", 4e-3), slow("slip", "shared", 0.0)])
def test_a_session_that_was_over_before_an_event_keeps_its_frames(name, frames, moved, tmp_path):
    """Each session's frames were saved as they were after the event: off by all of it in earlier ones."""
    made = make(CASES[name], 0, "aria")
    session = np.where(np.arange(len(made.data)) < 40, "A", "B")
    position = made.data.position + moved * (session == "A")[:, None]
    data = replace(made.data, session=session, position=position)
    found = diagnose(made.robot, data, held_out=0.2, frames=frames)
    assert [c.kind for c in found.causes] == [made.truth[0].kind]
    found.calibrated.save(tmp_path / "arm.toml")
    errors = 1e3 * evaluate(load_robot(tmp_path / "arm.toml"), data).errors.position
    of_a, now = errors[:40].mean(), errors[found.now.row :].mean()
    assert max(of_a, now) < 0.1
    assert list(found.robot.sessions) == ["B", "A"], "a URDF holds the first one: the arm as it is now"
    run = found.identification().best
    fitted = np.isin(data.row, run.fit.problem.data.row) & ((session == "A") | since(found, data))
    for form, left in left_by_files(found.robot, data, tmp_path).items():
        assert refitted_errors(run)[form].position_mm.mean == pytest.approx(left[fitted].mean(), abs=1e-6)
    assert mentions(file_text(run), "session A")
    assert errors[41 : made.truth[0].row - NEAR].mean() > 4.0 * now, "they share a session with rows after it"


def test_a_session_that_was_held_out_has_its_own_base_in_the_file(tmp_path):
    """All rows were fitted with one base: the file left 230 mm where the result stated 0.08."""
    made = make(CASES["slip"], 0, "aria")
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
    assert alone.file_errors["TOML"].position_mm == alone.held_out.position_mm
    for judged in (run, alone):
        shown = row_components(judged.as_measured, judged.held_out_data).position
        mean = 1e3 * np.linalg.norm(shown, axis=1).mean()
        assert mean == pytest.approx(judged.held_out.position_mm.mean, rel=1e-3)


@pytest.mark.parametrize("clock", ["none", slow("begins anew")])
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
