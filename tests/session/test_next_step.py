"""The next step, over all states of a session: its sentence, its tone, and where its buttons lead."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from direct_commands import done
from driven_effects import driven_file

from workbench.diagnosis.report.document import budget_bars
from workbench.diagnosis.result import Verdict
from workbench.identification.problem import Noise
from workbench.report.numbers import compared
from workbench.session import next_step as to
from workbench.session.commands.compare import ShowRow
from workbench.session.commands.data import LoadData, MeasureVirtualArm
from workbench.session.commands.diagnose import AddEffects, Diagnose
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget, plain
from workbench.session.commands.identify import Identify, LeaveRowsOut
from workbench.session.commands.messages import Tell
from workbench.session.commands.plate import ImprovePlate
from workbench.session.commands.undo import RestoreBest, Undo
from workbench.session.live_score import PlateTrial
from workbench.session.next_step import COMPARE, LOAD, TAKE, Action, NextStep, Tone, _foreign, next_step
from workbench.session.page_state import RunningJob, Severity, Tab
from workbench.session.part import AbstractPart
from workbench.session.stages import share_of_noise, stages, sure_errors
from workbench.session.state import Drag, Focus, Session
from workbench.session.target_steps import with_history
from workbench.views.page.panels.index import determined

TRIAL = Action("Try this plate", Tab.PLATE)


@pytest.fixture(autouse=True)
def trial(monkeypatch):
    """A plate can be tried, whichever extras are there."""
    monkeypatch.setattr("workbench.session.next_step._trial", lambda: TRIAL)


@pytest.fixture(scope="module")
def walked(first, tmp_path_factory) -> dict[str, Session]:
    """The whole way: what a session is at each step."""
    path, _ = driven_file("payload", tmp_path_factory.mktemp("driven"))
    loaded = done(first, LoadData(path.name, path.read_bytes()))
    identified = done(loaded, Identify(("opt2",)))
    diagnosed = done(identified, Diagnose())
    return {
        "first": first,
        "loaded": loaded,
        "identified": identified,
        "diagnosed": diagnosed,
        "added": done(diagnosed, AddEffects()),
    }


def test_a_plate_whose_blocks_overlap_is_told_of_and_not_kept_as_the_best(first):
    """While the target is dragged and afterwards, whatever error such a plate promises."""
    target = first.plate.targets[0]
    near = MoveTarget(1, plain(target.xyz + np.array([0.0, 0.03, 0.0])), plain(target.rpy))
    dragged, moved = done(first, GrabTarget(1), near), done(first, near)
    for step in (next_step(dragged), next_step(moved)):
        assert (step.tone, "blocks of targets 1 and 2 overlap" in step.sentence) == (Tone.BAD, True)
    promising = replace(moved, score=replace(moved.score, position=0.0))
    assert with_history(promising).history.best.plate is first.plate
    assert next_step(done(moved, next_step(moved).next.command)).tone is not Tone.BAD
    assert "overlap" in determined(moved)
    refused = done(moved, Tell("the file can't be made"))  # which is over with that plate
    assert refused.page.messages[-1].severity is Severity.ERROR
    undone = Undo().done(refused, done(refused, Undo()))
    assert not [m for m in undone.page.messages if m.severity is Severity.ERROR]


def test_results_of_other_rows_are_to_be_found_again(walked):
    found = walked["diagnosed"].results.identification
    other = done(walked["diagnosed"], LeaveRowsOut((int(found.data.row[found.train_rows[0]]),)))
    again = next_step(other)
    assert (again.tone, again.next.command) == (Tone.CAREFUL, Identify(("opt2",)))  # as it was asked for
    assert next_step(done(other, LeaveRowsOut(()))) == next_step(walked["diagnosed"])
    fresh = done(other, again.next.command)
    assert next_step(fresh).next.label == "Diagnose again"
    rows, out = fresh.results.comparison, other.measurements.left_out
    assert set(rows.number[rows.kept_out]) == out  # it can be looked at still, and used again
    shown = done(fresh, ShowRow(int(np.flatnonzero(rows.kept_out)[0])), again.next.command).results
    assert {shown.comparison.number[shown.row]} == out
    assert shown.comparison.errors[shown.row, 1] > 0.0  # known, but apart: it would dwarf all others
    assert next_step(done(fresh, LeaveRowsOut(()))).next.label == "Identify again"


def test_a_stuck_drag_says_why_and_every_reading_has_a_button(first):
    stuck = replace(unreached(first, reached=False, reason="it is too far"), drag=Drag(1, 2))
    assert "it is too far" in next_step(stuck).sentence
    rows = {"robot": "", "rival": "", "joints": (6, 6), "readings": ("a", "b", "c"), "text": "which?"}
    match = SimpleNamespace(**rows, meaning=None, name="a.csv", content=b"1", columns="")
    step, labels = _foreign(match, match), ["Jog the arm", "Read so: a", "Read so: b", "Read so: c"]
    assert [action.label for action in (step.next, step.other, *step.more)] == [*labels, "Identify anyway"]


def unreached(session: Session, **change) -> Session:
    first, second, third, *others = session.states
    return replace(session, states=(first, second, replace(third, **change), *others))


def with_noise(session: Session, times: float | None) -> Session:
    """As if the instrument's noise were so many times less than what is left; None: unknown."""
    found = replace(session.results.identification)
    left = found.runs[session.results.fit]
    mean = 1e-3 * (left.held_out or left.train).position_mm.mean
    noise = None if times is None else Noise(mean / (times * np.sqrt(8 / np.pi)), 1e-4)
    found.__dict__["instrument"] = noise
    return replace(session, results=replace(session.results, identification=found))


def few_rows(session: Session) -> Session:
    found = replace(session.results.identification, train_rows=session.results.identification.train_rows[:10])
    found.__dict__["instrument"] = Noise(1e-9, 1e-9)
    return replace(session, results=replace(session.results, identification=found))


def as_diagnosed(session: Session, **change) -> Session:
    """With a diagnosis that says something else."""
    return session.updated("results", diagnosis=replace(session.results.diagnosis, **change))


def unsure(session: Session) -> Session:
    """With causes that can't be distinguished from others."""
    return as_diagnosed(session, causes=tuple(replace(c, odds=3.0) for c in session.results.diagnosis.causes))


def unchanged(session: Session) -> Session:
    return session


def unasked(session: Session) -> Session:
    """Of which no accuracy is wanted."""
    return session.updated("choices", wanted=None)


def with_plate_kept(session: Session, position: float = 1e-4) -> Session:
    """Moved, and predicted to be so good [m]."""
    plate = replace(session.plate, xyz=session.plate.xyz + 0.01)
    moved = replace(session, plate=plate, score=replace(session.score, position=position))
    return unasked(moved.updated("history", done=(session.history.best,)))


def beside_rows(session: Session) -> Session:
    return session.updated("page", tab=Tab.PLATE).updated("playback", focus=Focus.TARGET)


def fallen_short(session: Session, **change) -> Session:
    """A plate on which 95 % of the arms keep 1.3 times what they have to."""
    at = (session.plate, session.noise, session.choices.wanted)
    trial = PlateTrial(*at, 200, 0.7, 0, 1.3, 1e-4, "tried", "instrument")
    return session.updated("history", done=(session.history.best,), **change).with_part(trial)


def with_a_wrong_row(session: Session) -> Session:
    """Held out, so that no fit has set it apart: means count it, as JSON and terminal do; advice doesn't."""
    wrong = with_noise(session, 7.0)
    found = wrong.results.identification
    k = int(np.argmax(found.best.held_out.position))
    vars(found)["suspects"] = (int(found.held_out_data.row[k]),)
    assert stages(wrong)[1].error == found.best.held_out.position_mm.mean
    assert sure_errors(wrong, found).position_mm.mean < stages(wrong)[1].error
    return wrong


def with_another_robot(session: Session) -> Session:
    """On the plate that it begins on, while undo leads back to the robot before."""
    return unasked(session.updated("history", done=(session.history.best,)))


@dataclass(frozen=True)
class Following(AbstractPart):
    """A part that names the next step."""

    def step(self, session: Session) -> NextStep | None:
        return NextStep("The real arm moves.", next=LOAD) if session.playback.focus is Focus.JOG else None


PLAIN, CAREFUL, GOOD, BAD, JOG = Tone.PLAIN, Tone.CAREFUL, Tone.GOOD, Tone.BAD, Focus.JOG
NOTHING = {"effects": (), "causes": (), "residual_map": None}
UNEXPLAINED = NOTHING | {"verdict": Verdict.UNEXPLAINED}
NOISE = NOTHING | {"verdict": Verdict.NO_EFFECT}
LOST = UNEXPLAINED | {"measure_next": np.zeros((0, 6))}
SAVES = to.calibrated_toml, to.calibrated_urdf
STATES = [
    # before, what is done to it, part of the sentence, tone, next and other action or their commands
    ("first", unchanged, "Drag an arrow", PLAIN, ImprovePlate, LOAD),
    ("first", lambda s: replace(s, drag=Drag(1, 0)), "Release", PLAIN, None, None),
    ("first", with_plate_kept, "Good enough?", PLAIN, LOAD, ImprovePlate),
    ("first", lambda s: with_plate_kept(s, np.nan), "reach the region", CAREFUL, ImprovePlate, LOAD),
    ("first", lambda s: with_plate_kept(s, 1.0), "Good enough?", PLAIN, LOAD, RestoreBest),
    ("loaded", lambda s: with_plate_kept(beside_rows(s)), "Good enough?", PLAIN, ImprovePlate, to.BACK),
    ("first", with_another_robot, "Drag an arrow", PLAIN, ImprovePlate, LOAD),
    ("first", lambda s: unreached(s, reached=False), "9 of 10 targets", BAD, SelectTarget(2), ImprovePlate),
    ("first", lambda s: unreached(s, hit="link 3"), "3 is blocked", BAD, SelectTarget(2), ImprovePlate),
    ("first", lambda s: fallen_short(s), "better places", CAREFUL, ImprovePlate(seed=1), to.MAKE),
    ("first", lambda s: fallen_short(s, searched=s.plate), "No better plate", CAREFUL, to.MAKE, LOAD),
    ("first", lambda s: s.updated("page", caption="A story."), "A story.", PLAIN, None, None),
    ("first", lambda s: s.updated("page", job=RunningJob("Diagnose")), "Diagnose …", PLAIN, None, None),
    ("first", lambda s: s.with_part(Following()).updated("playback", focus=JOG), "real", PLAIN, LOAD, None),
    ("loaded", unchanged, "rows", PLAIN, to.FIT, to.OTHER_ROWS),
    ("identified", lambda s: with_noise(s, 7.0), "7 × the instrument", CAREFUL, to.CAUSE, TAKE),
    ("identified", lambda s: unasked(with_noise(s, 1.2)), "noise", GOOD, TAKE, COMPARE),
    ("identified", lambda s: with_noise(s, None), "?", PLAIN, to.CAUSE, TAKE),
    ("identified", few_rows, "too few", CAREFUL, to.MORE, COMPARE),
    ("identified", with_a_wrong_row, "without row", CAREFUL, to.CAUSE, LeaveRowsOut),
    ("diagnosed", unchanged, "Joint 2 gives under load (certain)", GOOD, to.ADD, TAKE),
    ("diagnosed", lambda s: as_diagnosed(s, causes=()), "has no name", CAREFUL, to.CORRECT, TAKE),
    ("diagnosed", unsure, "one of several", CAREFUL, to.ADD, TAKE),
    ("diagnosed", lambda s: as_diagnosed(s, **UNEXPLAINED), "left", CAREFUL, to.POSES, TAKE),
    ("diagnosed", lambda s: as_diagnosed(s, **LOST), "", CAREFUL, to.MORE, TAKE),
    ("diagnosed", lambda s: unasked(as_diagnosed(s, **NOISE)), "noise", GOOD, TAKE, COMPARE),
    ("diagnosed", lambda s: as_diagnosed(s, **NOISE), "1 mm", BAD, TAKE, COMPARE),
    ("added", unchanged, "describes the arm as measured", GOOD, *SAVES),
    ("identified", lambda s: few_rows(s).updated("page", tab=Tab.COMPARE), "few", CAREFUL, to.MORE, None),
    ("first", lambda s: s.updated("page", tab=Tab.MEASURE), "Nothing has been", PLAIN, None, to.PLATE),
    ("added", lambda s: as_diagnosed(s, causes=()), "not all by certain causes", PLAIN, *SAVES),
    ("added", unsure, "not all by certain causes", PLAIN, *SAVES),
    ("added", lambda s: as_diagnosed(s, verdict=Verdict.PARTLY), "TOML", CAREFUL, *SAVES),
]


def leads(action: Action | None, wanted) -> bool:
    """Whether an action is the wanted one, or has the wanted command, or one of the wanted kind."""
    if action is None or wanted is None:
        return action is wanted
    is_kind = isinstance(wanted, type) and isinstance(action.command, wanted)
    return is_kind or wanted in (action, action.command, action.save)


@pytest.mark.parametrize(("before", "change", "text", "tone", "following", "other"), STATES)
def test_every_state_says_where_it_stands_and_what_is_next(
    walked, before, change, text, tone, following, other
):
    step = next_step(change(walked[before]))
    assert text in step.sentence
    assert step.sentence.endswith((".", "?"))
    assert "nan" not in step.sentence
    assert step.tone is tone
    assert leads(step.next, following)
    assert leads(step.other, other)
    if change is with_a_wrong_row:
        assert (step.other.label[:12], type(step.other.then)) == ("Exclude row ", Identify)


def test_what_its_buttons_do_makes_sense_there(walked):
    """Every command that is offered passes its own check in the state that offers it."""
    for before, change, *_ in STATES:
        session = change(walked[before])
        step = next_step(session)
        for action in (step.next, step.other):
            if isinstance(action, Action) and action.command is not None:
                action.command.check(session)


def test_errors_fall_stage_by_stage_on_the_same_rows(walked):
    titles, errors = zip(*((stage.title, stage.error) for stage in stages(walked["added"])), strict=True)
    assert titles == ("nominal", "geometry", "with effects")
    assert errors[:2] == tuple(stage.error for stage in stages(walked["diagnosed"]))  # as before Add
    assert errors[0] > errors[1] > errors[2]
    pair = f"Mean error {compared(errors[0])} → {compared(errors[2])} mm"
    assert next_step(walked["added"]).sentence.startswith(pair)
    assert stages(walked["loaded"]) == ()
    parts = [bar.value for bar in budget_bars(walked["diagnosed"].results.diagnosis).rows]
    whole = walked["diagnosed"].results.diagnosis.before.judged.position_mm.mean
    assert np.linalg.norm(parts) == pytest.approx(whole)  # no part is larger than the whole


def test_the_instrument_is_known_where_rows_state_it(first):
    session = done(first, MeasureVirtualArm(2), Identify(("ols",)))
    assert session.results.identification.instrument.position == pytest.approx(session.noise.position)
    assert 0.3 < share_of_noise(session, session.results.identification) < 3.0
