"""The next step: the state of a session in one sentence, and what to do next. Nothing here computes or draws.

Drag → measure → identify → diagnose → add → compare → take away; the second button of a step leads back.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.base.errors import DataError
from workbench.base.wording import capital, plural
from workbench.data.dataset import Dataset
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.identification.checks.arm_match import ArmMatch
from workbench.identification.errors.row_errors import RowErrors
from workbench.identification.result import LOOK_AGAIN, Identification, Run, Validation, judged
from workbench.identification.rows.row_selection import check_enough
from workbench.report.numbers import compared
from workbench.session.command import AbstractCommand, kinds
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import MIN_ROWS, AddEffects, Diagnose, TakeNextPoses
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.plate import AbstractPlateTrial, ImprovePlate, more_targets
from workbench.session.commands.sessions import SPLIT, MakeSession, splittable
from workbench.session.commands.undo import Undo
from workbench.session.export import File, NotedFile, fixture_zip
from workbench.session.judgement import Tone, arm_judgement, plate_judgement
from workbench.session.loaded_measurements import MeasurementFile
from workbench.session.page_state import Tab
from workbench.session.state import Focus, Session

UNMEASURED = "Nothing has been measured yet. Load the rows of a real arm, or measure a virtual one."
NORM_OF_NOISE = float(np.sqrt(8.0 / np.pi))
"""Mean length of a position error of three normal components of unit deviation."""
BEYOND_NOISE = 1.5
"""Ratio of remaining error to instrument noise above which it is not noise alone."""


@dataclass(frozen=True)
class Action:
    """What a button of the step does.

    Args:
        label: On the button.
        tab: Where its outcome is seen.
        command: What is carried out, if anything.
        save: What is handed out as a file, if anything.
    """

    label: str
    tab: Tab
    command: AbstractCommand | None = None
    save: Callable[[Session], File | NotedFile] | None = None


@dataclass(frozen=True)
class NextStep:
    """The state of a session.

    Args:
        sentence: The verdict.
        tone: How it is meant.
        next: What to do now, if the program can.
        other: The other way, mostly a step back.
        figure: The number that counts now, for a sentence without numbers.
    """

    sentence: str
    tone: Tone = Tone.PLAIN
    next: Action | None = None
    other: Action | None = None
    figure: str = ""


LOAD = Action("Measure", Tab.MEASURE)
COLUMNS = Action("Columns of the file", Tab.MEASURE)
MORE = Action("Measure more", Tab.MEASURE)
FIT = Action("Identify the geometry", Tab.CALIBRATE, Identify())
CAUSE = Action("Find the cause", Tab.CALIBRATE, Diagnose())
ADD = Action("Add the effects found", Tab.CALIBRATE, AddEffects())
PLATE = Action("Back to the plate", Tab.PLATE)
BACK = Action("Back to the calibration", Tab.CALIBRATE)
KEEP = Action(Undo.title, Tab.CALIBRATE, Undo())
COMPARE = Action("Compare", Tab.COMPARE)
TAKE = Action("Save the arm …", Tab.EXPORT)
MAKE = Action("Plate to make (ZIP)", Tab.PLATE, save=fixture_zip)
OTHER_ARM = Action("Choose the robot", Tab.ROBOT)
POSES = Action("Add the next poses as targets", Tab.PLATE, TakeNextPoses())


def next_step(session: Session) -> NextStep:
    """The state of this session; where it advises to save the arm, the tone is no better than the verdict."""
    measured, file = session.measurements, session.measurements.unread
    step = _levelled(_next_step(session), measured.levelled)
    if measured.loaded is not None and session.is_idle and file is not None and file.match is not None:
        step = replace(step, other=_change_to(file.match))
    judged = arm_judgement(session) if step.next == TAKE else None
    if judged is None:
        return step
    tone = max(step.tone, judged.tone, key=[Tone.GOOD, Tone.PLAIN, Tone.CAREFUL, Tone.BAD].index)
    return replace(step, sentence=f"{step.sentence} {judged.text}.", tone=tone)


def _levelled(step: NextStep, levelled: bool) -> NextStep:
    """The step whose buttons know whether the instrument is levelled."""

    def with_level(action: Action | None) -> Action | None:
        if action is None or not isinstance(action.command, Identify | Diagnose):
            return action
        return replace(action, command=replace(action.command, levelled=levelled))

    return replace(step, next=with_level(step.next), other=with_level(step.other))


def _next_step(session: Session) -> NextStep:
    if session.page.caption:
        return NextStep(session.page.caption, figure=_figure(session))
    if session.page.job is not None:
        return NextStep(f"{session.page.job.title} … You can keep working.")
    if session.drag is not None:
        return NextStep(f"Release to keep this position; {_predicted(session)}.")
    for part in sorted(session.parts.values(), key=lambda part: not part.is_mode):
        if (step := part.step(session)) is not None:
            return step
    file, loaded = session.measurements.unread, session.measurements.loaded
    if session.playback.focus is Focus.TRACK:
        return NextStep(
            "The solid arm moves as commanded, the orange one as the calibrated model predicts.", next=COMPARE
        )
    if concluded := next((part.conclusion for part in session.parts.values() if part.conclusion), ""):
        return NextStep(concluded, Tone.GOOD, LOAD)
    if loaded is None and file is not None and file.match is not None and file.match.rival:
        return _foreign(file.match)
    if file is not None and file.match is None and (loaded is None or loaded.is_foreign):
        return NextStep(f"{file.name} has not been read yet: assign its columns.", Tone.CAREFUL, COLUMNS)
    if loaded is None or _takes_next_poses(session):
        return _design(session)
    if session.page.tab is Tab.PLATE:
        return _plate_beside_rows(session)
    results, found = session.results, session.results.diagnosis
    if results.identification is None and found is None:
        if loaded.match is not None and loaded.is_foreign:
            return _foreign(loaded.match, loaded.file)
        if lack := _lack(session.robot, loaded.dataset):
            return NextStep(f"{capital(lack)}.", Tone.CAREFUL, MORE, FIT)
        other = KEEP if _is_put_away(session) else LOAD
        return NextStep(
            f"Loaded: {plural(len(loaded.dataset), 'row')} of {loaded.name}.", next=FIT, other=other
        )
    if results.accepted:
        left, tone = _rest(found)
        return NextStep(f"{before_and_after(session)}. {left}.", tone, TAKE, COMPARE)
    if found is not None:
        return _diagnosed(session, found)
    assert results.identification is not None
    return _identified(session, results.identification)


def _is_put_away(session: Session) -> bool:
    """Whether undo restores a calibration."""
    before = session.history.done[-1].session if session.history.done else None
    return before is not None and before.results.identification is not None


def _plate_beside_rows(session: Session) -> NextStep:
    """The step for the plate while rows are loaded: it leads back to these."""
    if not session.shows_plate:
        show = Action("Show the plate", Tab.PLATE, SelectTarget(session.selected))
        text = f"The scene shows the measured rows. For the plate: {_predicted(session)}."
        return NextStep(text, next=show, other=BACK)
    step = _design(session)
    following, other = (BACK if action == LOAD else action for action in (step.next, step.other))
    return replace(step, next=following, other=other)


@lru_cache(maxsize=2)
def _lack(robot: Robot, data: Dataset) -> str:
    """Why rows are too few for the arm's parameters; empty if they are enough."""
    try:
        check_enough(robot, data, None)
    except DataError as error:
        return str(error)
    return ""


def _rest(found: Diagnosis | None) -> tuple[str, Tone]:
    """What is left once everything found is in the model; good only where its causes are named."""
    if found is None or found.is_good:
        return "The model now describes the real arm", Tone.GOOD
    if not found.causes:
        return "A residual map predicts the rest; no cause is named", Tone.PLAIN
    if not found.is_named:
        return "The added effects predict the rest; no cause is certain", Tone.PLAIN
    return "No known effect explains the rest", Tone.CAREFUL


def _foreign(match: ArmMatch, file: MeasurementFile | None = None) -> NextStep:
    """Rows of another arm, or of a file with wrong headings: what is to be changed, if it is known."""
    anyway = OTHER_ARM
    if match.joints[0] == match.joints[1]:
        anyway = Action("Identify anyway", Tab.CALIBRATE, Identify(anyway=True))
    change = _change_to(match)
    if match.has_reading and file is not None:
        read_so = LoadData(file.name, file.content, file.mapping, accept=True)
        change = Action("Read so", Tab.MEASURE, read_so)
    return NextStep(f"{capital(match.text)}.", Tone.BAD, change, anyway)


def _change_to(match: ArmMatch) -> Action:
    """To the built-in arm that the rows fit, with them; to choose one if none does."""
    if not match.rival:
        return OTHER_ARM
    return Action(f"Change to {match.rival_name}", Tab.CALIBRATE, ChooseRobot(match.rival, keep=True))


@dataclass(frozen=True, eq=False)
class StageErrors:
    """Errors up to one stage of the model.

    Args:
        title: What the model has by then.
        error: Mean position error [mm].
        rows: Position errors row by row [m].
    """

    title: str
    error: float
    rows: Float[np.ndarray, " rows"]

    @classmethod
    def of(cls, title: str, errors: Validation | Run, rows: tuple[RowErrors, RowErrors]) -> "StageErrors":
        """Errors on held-out rows; on the fitted ones where none were held out."""
        fitted, held_out = rows
        chosen = fitted if errors.held_out is None else held_out
        return cls(title, judged(errors).position_mm.mean, chosen.position)


def stages(session: Session) -> tuple[StageErrors, ...]:
    """Errors of the nominal arm, with its geometry, with what was found: what there is, on the same rows."""
    found, diagnosis = session.results.identification, session.results.diagnosis
    if found is None:
        return ()
    out = [StageErrors.of("nominal", found.nominal, found.nominal_rows)]
    if session.results.accepted and (geometry := session.results.geometry) is not None:
        out.append(StageErrors.of("geometry", geometry, (geometry.train_rows, geometry.held_out_rows)))
    elif session.results.accepted and diagnosis is not None:
        out.append(StageErrors.of("geometry", diagnosis.before, diagnosis.before_rows))
    has_cause = diagnosis is None or bool(diagnosis.causes)
    title = "geometry"
    if session.results.accepted:
        title = "with causes" if has_cause else "with residual map"
    run = found.runs[session.results.fit]
    return (*out, StageErrors.of(title, run, (run.train_rows, run.held_out_rows)))


def before_and_after(session: Session) -> str:
    """Errors of the nominal arm and of the calibrated one as it stands: `0.739 → 0.072 mm`."""
    first, *_, last = stages(session)
    return f"{compared(first.error)} → {compared(last.error)} mm"


def noise_length(found: Identification) -> float:
    """Mean length of the instrument's position errors [mm]; NaN where its noise is unknown."""
    known = found.instrument
    return 1e3 * NORM_OF_NOISE * known.position if known is not None else float("nan")


def share_of_noise(session: Session, found: Identification) -> float:
    """How many times the instrument's noise is left on average; NaN where that is unknown."""
    left, noise = judged(found.runs[session.results.fit]).position_mm.mean, noise_length(found)
    return left / noise if noise > 0.0 else float("nan")


def _figure(session: Session) -> str:
    """Errors stage by stage, or what is predicted before there are any [mm]."""
    fitted, found = session.results.identification, session.results.diagnosis
    if fitted is not None:
        errors = [stage.error for stage in stages(session)]
        if found is not None and found.effects and not session.results.accepted:
            errors.append(judged(found.after).position_mm.mean)
        return f"{' → '.join(map(compared, errors))} mm"
    predicted = 1e3 * session.score.position
    is_plate = session.measurements.loaded is None and np.isfinite(predicted)
    return f"{predicted:.3f} mm rms predicted" if is_plate else ""


def _design(session: Session) -> NextStep:
    """The step for the plate, before anything is measured on it."""
    seed = len(session.history.scores)
    improve = Action(ImprovePlate.title, Tab.PLATE, ImprovePlate(seed))
    bad = [(i, state) for i, state in enumerate(session.states) if not state.measurable]
    if bad:
        (first, state), count = bad[0], len(session.plate)
        why = "is out of reach" if not state.reached else f"is blocked: {state.hit}"
        text = f"{count - len(bad)} of {count} targets can be measured; target {first + 1} {why}."
        fix = Action(f"Show target {first + 1}", Tab.PLATE, SelectTarget(first))
        return NextStep(text, Tone.BAD, fix, improve)
    if _takes_next_poses(session):
        return NextStep("The suggested poses are now targets; measure them.", next=LOAD, other=FIT)
    if session.page.tab in (Tab.MEASURE, Tab.CALIBRATE, Tab.COMPARE, Tab.EXPORT):
        is_there = session.page.tab is Tab.MEASURE
        return NextStep(UNMEASURED, next=None if is_there else LOAD, other=PLATE if is_there else None)
    judged, trial = plate_judgement(session), _trial()
    is_untouched = (
        session.plate is session.history.first_plate and session.history.searched is not session.plate
    )
    if is_untouched and (judged is None or not session.history.done):
        text = "Drag an arrow to move the blue target, a ring to turn it; the arm follows"
        return NextStep(f"{text}. Or let the program place all targets.", next=improve, other=LOAD)
    text = capital(_predicted(session))
    if judged is None and not np.isfinite(session.score.position):
        tone = Tone.CAREFUL if np.isinf(session.score.position) else Tone.PLAIN
        can_help = session.history.searched is not session.plate
        return NextStep(f"{text}.", tone, improve if can_help else LOAD, LOAD if can_help else None)
    if judged is None:
        return NextStep(f"{text}. Good enough?", next=trial or LOAD, other=LOAD if trial else improve)
    if judged.tone is Tone.GOOD:
        return NextStep(f"{capital(judged.text)}. Make the plate, then measure.", Tone.GOOD, MAKE, LOAD)
    if judged.tone is Tone.CAREFUL:
        text = capital(judged.text) if session.tried is not None else f"{text}: {judged.text}"
        if session.history.searched is not session.plate:
            text = f"{text}. A search may find better places for the targets"
        elif (number := more_targets(session)) is not None:
            text = f"{text}. These places are the best found; more targets lower the error"
            improve = Action(f"Search {number} targets", Tab.PLATE, ImprovePlate(seed, number))
        else:
            blame = "" if session.tried is None else f": the {session.tried.blame} dominates"
            text = f"{text}. No better plate was found{blame}"
            if not np.isfinite(session.score.position):
                return NextStep(f"{text}. Add targets at other places and heights.", judged.tone, LOAD)
            return NextStep(f"{text}. Require less, or measure more exactly.", judged.tone, MAKE, LOAD)
        return NextStep(f"{text}.", judged.tone, improve, MAKE if session.tried is not None else LOAD)
    text = f"{text}: {judged.text}. Good enough?"
    return NextStep(text, judged.tone, trial or LOAD, LOAD if trial else improve)


@cache
def _trial() -> Action | None:
    """The plate tried on virtual arms, where an extra does so."""
    found = next((kind for kind in kinds().values() if issubclass(kind, AbstractPlateTrial)), None)
    return None if found is None else Action("Try this plate", Tab.PLATE, found())


def _predicted(session: Session) -> str:
    now, first = (1e3 * score.position for score in (session.score, session.history.first_score))
    if np.isnan(now) and session.region.sampled is session.plate.region:
        return "the arm does not reach the region"
    if not np.isfinite(now):
        return f"the predicted error {'is unbounded' if np.isinf(now) else 'has not been computed yet'}"
    began = f", {first:.3g} mm at the start" if np.isfinite(first) and f"{first:.3g}" != f"{now:.3g}" else ""
    return f"predicted error after calibration {now:.3g} mm rms{began}"


def _takes_next_poses(session: Session) -> bool:
    """Whether poses of the diagnosis stand on the plate, and the plate is looked at."""
    if session.results.diagnosis is None or session.playback.focus is not Focus.TARGET:
        return False
    wanted = [np.asarray(q) for q in session.results.diagnosis.measure_next]
    return any(
        target.q is not None and any(np.array_equal(target.q, q) for q in wanted)
        for target in session.plate.targets
    )


def _identified(session: Session, found: Identification) -> NextStep:
    errors, times, known = before_and_after(session), share_of_noise(session, found), found.identifiability
    if doubts := found.doubts(found.runs[session.results.fit]):
        return NextStep(f"Implausible: {', '.join(doubts[:2])}; {LOOK_AGAIN}", Tone.CAREFUL, COMPARE, LOAD)
    if known is not None and known.refused:
        text = f"No parameter of the arm was identified: {known.advice or known.refused}."
        return NextStep(text, Tone.CAREFUL, MORE, COMPARE)
    if known is not None:
        return NextStep(f"{errors}; {known.title} identified.", Tone.GOOD, TAKE, COMPARE)
    if times <= BEYOND_NOISE:
        return NextStep(f"{errors}: the remaining error is instrument noise.", Tone.GOOD, TAKE, COMPARE)
    if (rows := len(found.train_rows)) < MIN_ROWS:
        text = f"{rows} rows are too few to look for a cause of the rest; {MIN_ROWS} are needed"
        return NextStep(f"{errors}. {text}.", Tone.CAREFUL, MORE, COMPARE)
    if np.isnan(times):
        return NextStep(f"{errors}. Is the rest noise, or an error beyond geometry?", next=CAUSE, other=TAKE)
    text = f"{errors}. Geometry can't explain the rest, {times:.2g} × the instrument noise."
    return NextStep(text, Tone.CAREFUL, CAUSE, TAKE)


def _diagnosed(session: Session, found: Diagnosis) -> NextStep:
    left = judged(session.results.run or found.before).text("mean")
    promise = judged(found.after).text("mean").replace(", ", " and ") + " would be left."
    poses = POSES if len(found.measure_next) else MORE
    if steps := splittable(session):
        row, mark = next((e.row, e.mark) for e in found.events if e.row in steps)
        text = f"{capital(mark)}: rows {row} and later need their own base or tool."
        return NextStep(text, Tone.CAREFUL, Action(SPLIT, Tab.CALIBRATE, MakeSession(row)), ADD)
    if found.harm is not None:
        return NextStep(f"{capital(found.harm)}.", Tone.CAREFUL, TAKE, poses)
    if found.effects:
        if not found.causes:
            text = f"No cause can be named. With a residual map, {promise}"
            return NextStep(text, Tone.CAREFUL, ADD, poses)
        first, more = found.causes[0], len(found.causes) - 1
        others = f" and {more} more" if more else ""
        tone = Tone.GOOD if found.is_named else Tone.CAREFUL
        whole = "these" if more or found.residual_map is not None else "it"
        text = f"{capital(first.plain)} ({first.confidence}){others}. With {whole}, {promise}"
        return NextStep(text, tone, ADD, poses)
    if not found.is_tried:
        return NextStep(f"{capital(found.verdict_text)}; {left} left.", Tone.CAREFUL, poses, TAKE)
    if found.verdict is Verdict.UNEXPLAINED:
        return NextStep(f"{left} left; no effect explains it.", Tone.CAREFUL, poses, TAKE)
    text = f"{left} left, all of it noise: the geometric model is sufficient."
    return NextStep(text, Tone.GOOD, TAKE, COMPARE)
