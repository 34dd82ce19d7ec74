"""The next step: the state of a session in one sentence, and what to do next. Nothing here computes or draws.

Drag → measure → identify → diagnose → add → compare → take away; the second button of a step leads back. Of
the rows of a table (`ROWS`) the first that applies to the session says the step.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from workbench.base.wording import capital, plural
from workbench.diagnosis.confidence import PROBABLE
from workbench.diagnosis.result import Diagnosis, Verdict
from workbench.identification.checks.arm_match import ArmMatch
from workbench.identification.errors.row_errors import Errors
from workbench.identification.result import implausible_text
from workbench.plate.optimiser.target_blocks import overlapping_blocks
from workbench.plate.plate import AUTO
from workbench.report.blocks import Tone
from workbench.report.numbers import compared
from workbench.session.command import AbstractCommand, kinds
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.diagnose import MIN_ROWS, AddEffects, Diagnose
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.edit import ChooseBranch
from workbench.session.commands.identify import Identify, LeaveRowsOut
from workbench.session.commands.plate import AbstractPlateTrial, ImprovePlate
from workbench.session.commands.undo import RestoreBest
from workbench.session.export import Make, calibrated_toml, calibrated_urdf, fixture_zip, next_poses_csv
from workbench.session.loaded_measurements import MeasurementFile, is_of_other_rows
from workbench.session.page_state import Tab
from workbench.session.stages import (
    arm_judgement,
    before_and_after,
    learned,
    plate_judgement,
    share_of_noise,
    stages,
    suspects,
)
from workbench.session.state import Session

BEYOND_NOISE = 1.5
"""Ratio of remaining error to instrument noise above which it is not noise alone."""


@dataclass(frozen=True)
class Action:
    """A button: its label, the tab where its outcome is seen, the command, what follows it, or the file."""

    label: str
    tab: Tab
    command: AbstractCommand | None = None
    then: AbstractCommand | None = None
    save: Make | None = None


@dataclass(frozen=True)
class NextStep:
    """The verdict, how it is meant, what to do now, another way (mostly back), the figure, more ways."""

    sentence: str
    tone: Tone = Tone.PLAIN
    next: Action | None = None
    other: Action | None = None
    figure: str = ""
    more: tuple[Action, ...] = ()


LOAD = Action("Measure", Tab.MEASURE)
OTHER_ROWS = replace(LOAD, label="Other measurements")
COLUMNS = Action("Columns of the file", Tab.MEASURE)
MORE = Action("Measure more", Tab.MEASURE)
FIT = Action("Identify the geometry", Tab.CALIBRATE, Identify())
CAUSE = Action("Find the cause", Tab.CALIBRATE, Diagnose())
ADD = Action("Add the effects found", Tab.CALIBRATE, AddEffects())
CORRECT = replace(ADD, label="Add the correction")
PLATE = Action("Back to the plate", Tab.PLATE)
BACK = Action("Back to the calibration", Tab.CALIBRATE)
BEST = Action("Back to the best plate", Tab.PLATE, RestoreBest())
COMPARE = Action("Compare", Tab.COMPARE)
TAKE = Action("Save the arm as URDF", Tab.EXPORT, save=calibrated_urdf)
MAKE = Action("Plate to make (ZIP)", Tab.PLATE, save=fixture_zip)
JOG = Action("Jog the arm", Tab.ROBOT)
OTHER_ARM = Action("Choose the robot", Tab.ROBOT)
POSES = Action("Save the next poses (CSV)", Tab.CALIBRATE, save=next_poses_csv)


def next_step(session: Session) -> NextStep:
    """The state of this session; where it advises to save the arm, the tone is no better than the verdict.

    Nothing leads to the tab that is open.
    """
    row, step = next((row, found) for row in ROWS if (found := row(session)) is not None)
    if row in RESULTS and (exclude := _exclude_suspects(session)) is not None:
        beside = () if step.other is None or not step.more else (step.other, *step.more)
        step = replace(step, other=exclude, more=beside)
    loaded, file = session.measurements.loaded, session.measurements.unread
    if loaded is not None and file is not None and file.match is not None and session.is_idle:
        step = replace(step, other=_change_to(file.match))
    judged = arm_judgement(session) if step.next is not None and step.next.tab is Tab.EXPORT else None
    if judged is not None:
        tone = max(step.tone, judged.tone, key=[Tone.GOOD, Tone.PLAIN, Tone.CAREFUL, Tone.BAD].index)
        step = replace(step, sentence=f"{step.sentence} {judged.text}.", tone=tone)
    step = replace(step, sentence=session.measurements.named(step.sentence))
    is_new = lambda at: at is not None and (at.tab is not session.page.tab or at.command or at.save)  # noqa: E731
    following, other = (at if is_new(at) else None for at in (step.next, step.other))
    return replace(step, next=following, other=other, more=tuple(filter(is_new, step.more)))


def _under_way(session: Session) -> NextStep | None:
    if why := session.page.only_shown:
        return NextStep(f"{why}.", Tone.CAREFUL)
    if session.page.caption:
        return NextStep(session.page.caption, figure=_figure(session))
    if session.page.job is not None:
        known, done = session.results.identification, stages(session)
        if session.page.job.title == Diagnose.title and known is not None and np.isfinite(done[-1].error):
            times, left = share_of_noise(session, known), f"{compared(done[-1].error)} mm"
            noise = f"not noise, {times:.2g} × the instrument's" if times > BEYOND_NOISE else "noise or more"
            return NextStep(f"{left} left: {noise}. Looking for a cause …")
        return NextStep(f"{session.page.job.title} … You can keep working.")
    if session.drag is not None:
        state, number = session.states[session.drag.target], session.drag.target + 1
        if not state.measurable:
            return NextStep(f"Target {number} does not count here: {state.reason or state.hit}.", Tone.BAD)
        if met := overlapping_blocks(session.plate):
            return NextStep(f"{capital(met)}.", Tone.BAD)
        return NextStep(f"Release to keep this position; {_predicted(session)}.")
    return None


def _of_extras(session: Session) -> NextStep | None:
    """What an extra says while its part stands, that of a mode first."""
    parts = sorted(session.parts.values(), key=lambda part: not part.is_mode)
    return next((step for part in parts if (step := part.step(session)) is not None), None)


def _unread(session: Session) -> NextStep | None:
    """A file that the session's robot can't read."""
    file, loaded = session.measurements.unread, session.measurements.loaded
    if file is None or (loaded is not None and (file.match is not None or not loaded.is_foreign)):
        return None
    if file.match is None:
        if not file.is_plain:
            return None
        return NextStep(f"{file.name} has not been read yet: assign its columns.", Tone.CAREFUL, COLUMNS)
    return _foreign(file.match) if file.match.rival else None


def _design(session: Session) -> NextStep | None:
    """The plate, while it is designed; beside rows the step leads back to these."""
    is_beside = session.measurements.loaded is not None
    if is_beside and session.page.tab is not Tab.PLATE:
        return None
    if is_beside and not session.shows_plate:
        show = Action("Show the plate", Tab.PLATE, SelectTarget(session.selected))
        text = f"The scene shows the measured rows. For the plate: {_predicted(session)}."
        return NextStep(text, next=show, other=BACK)
    step = _plate(session)
    ways = [at for at in (step.next, step.other) if not (is_beside and at == LOAD)]
    following, other = (*ways, BACK, None)[:2]
    return replace(step, next=following, other=other)


def _loaded(session: Session) -> NextStep | None:
    """Rows of which nothing has been found yet."""
    loaded, results = session.measurements.loaded, session.results
    assert loaded is not None
    if results.identification is not None or results.diagnosis is not None:
        return None
    if loaded.match is not None and loaded.is_foreign:
        return _foreign(loaded.match, loaded.file)
    return NextStep(
        f"Loaded: {plural(len(loaded.dataset), 'row')} of {loaded.name}.", next=FIT, other=OTHER_ROWS
    )


def _stale(session: Session) -> NextStep | None:
    """What was found from other rows than those that are kept now."""
    results, out = session.results, session.measurements.left_out
    again = replace(FIT, label="Identify again", command=results.asked or FIT.command)
    if not is_of_other_rows(results.identification, out):
        again = replace(CAUSE, label="Diagnose again")
        if results.accepted or not is_of_other_rows(results.diagnosis, out):
            return None
    text = f"{plural(len(out), 'row')} excluded now; the result is still of the former ones."
    return NextStep(text, Tone.CAREFUL, again, COMPARE)


def _added(session: Session) -> NextStep | None:
    """Everything found is in the model; the tone is good only where the causes of the rest are named."""
    found = session.results.diagnosis
    if not session.results.accepted:
        return None
    if found is not None and not found.is_named:
        much = learned(found) and f"What was learned from the rows, without a cause, covers {learned(found)}"
        left, tone = much or "Part of the rest is predicted now, but not all by certain causes", Tone.PLAIN
    elif found is None or found.is_good:
        left, tone = "The model now describes the arm as measured", Tone.GOOD
    else:
        ask = "" if found.remaining.known_noise else "; state the instrument's noise to know if it is more"
        left, tone = f"No known effect explains the rest{ask}", Tone.CAREFUL
    sentence = f"{before_and_after(session)}. {left}."
    run = session.results.run
    left_by = {name: e.position_mm.mean for name, e in ({} if run is None else run.file_errors).items()}
    if not left_by.get("URDF", 0.0) > left_by.get("TOML", 0.0):
        return NextStep(sentence, tone, TAKE, COMPARE)
    urdf, toml = (f"Save as {name} ({compared(left_by[name])} mm)" for name in ("URDF", "TOML"))
    sentence += " Only the TOML holds all of it; a URDF holds geometry alone, fitted again for that."
    whole = replace(TAKE, label=toml, save=calibrated_toml)
    return NextStep(sentence, tone, whole, replace(TAKE, label=urdf), more=(COMPARE,))


def _diagnosed(session: Session) -> NextStep | None:
    found, known = session.results.diagnosis, stages(session)
    if found is None:
        return None
    before = known[-1].errors if known else found.before.judged
    left = before.text("mean")
    poses = POSES if len(found.measure_next) else MORE
    if found.harm is not None:
        return NextStep(f"{capital(found.harm)}.", Tone.CAREFUL, TAKE, poses)
    if found.effects:
        tone, promise = (
            Tone.GOOD if found.is_named else Tone.CAREFUL,
            _promise(found, before, found.after.judged),
        )
        return NextStep(promise, tone, ADD if found.causes else CORRECT, TAKE if known else poses)
    if not found.is_tried or found.verdict is Verdict.UNEXPLAINED:
        return NextStep(f"{capital(found.verdict_text)}; {left} left.", Tone.CAREFUL, poses, TAKE)
    rest = "all of it noise" if found.remaining.known_noise else "and nothing found in it"
    return NextStep(f"{left} left, {rest}: the geometric model is sufficient.", Tone.GOOD, TAKE, COMPARE)


def _promise(found: Diagnosis, before: Errors, after: Errors) -> str:
    """The first cause, and what would be left with all that was found."""
    rest, left = (errors.text("mean").replace(", ", " and ") for errors in (before, after))
    left += " would be left."
    if not found.causes:
        return f"The rest ({rest}) has no name. With a correction learned from your rows, {left}"
    first, more = found.causes[0], len(found.causes) - 1
    others = f" and {more} more" if more else ""
    whole = "these" if more or found.residual_map is not None else "it"
    fits = "one of several causes that fit these rows" if first.odds < PROBABLE else first.confidence
    return f"{capital(first.plain)} ({fits}){others}. With {whole}, {left}"


def _identified(session: Session) -> NextStep | None:
    found = session.results.identification
    assert found is not None
    errors, times, known = before_and_after(session), share_of_noise(session, found), found.identifiability
    if doubts := found.doubts(found.runs[session.results.fit]):
        return NextStep(capital(implausible_text(doubts[:2])), Tone.CAREFUL, COMPARE, OTHER_ROWS)
    if known.refused:
        text = f"No parameter was identified: {known.advice or known.refused}."
        return NextStep(text, Tone.CAREFUL, MORE, COMPARE)
    if known.is_limited:
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


ROWS: tuple[Callable[[Session], NextStep | None], ...] = (
    _under_way,
    _of_extras,
    _unread,
    _design,
    _loaded,
    _stale,
    _added,
    _diagnosed,
    _identified,
)
"""Steps in the order in which they go before each other; None where one does not apply."""
RESULTS = _added, _diagnosed, _identified


def _exclude_suspects(session: Session) -> Action | None:
    """Excludes the held-out rows of the same file that no arm explains, and finds the result without them."""
    loaded, out = session.measurements.loaded, session.measurements.left_out
    found = session.results.identification or session.results.diagnosis
    wrong = {*suspects(session)} - out
    after = _stale(session.updated("measurements", left_out=out | wrong)) if wrong else None
    if loaded is None or found is None or after is None or not (after.next and found.is_one_file):
        return None
    named = f"row {session.measurements.row_name(min(wrong))}" if len(wrong) == 1 else f"{len(wrong)} rows"
    label = f"Exclude {named}, {after.next.label.lower()}"
    return Action(label, Tab.CALIBRATE, LeaveRowsOut(tuple(sorted(out | wrong))), after.next.command)


def _foreign(match: ArmMatch, file: MeasurementFile | None = None) -> NextStep:
    """Rows of another arm, or of a file with wrong headings: what is to be changed, if it is known."""
    anyway, change, more = OTHER_ARM, _change_to(match), list[Action]()
    if match.joints[0] == match.joints[1]:
        anyway = Action("Identify anyway", Tab.CALIBRATE, Identify(anyway=True))
    if match.readings and file is not None:
        labels = (
            (how, f"Read so: {_inverted(how, match)}".removesuffix(": found")) for how in match.readings
        )
        choose = partial(ChooseRobot, match.robot, keep=True)
        read = [Action(label, Tab.CALIBRATE, choose(reading=how)) for how, label in labels]
        change, anyway, *more = *([JOG] if len(read) > 1 else []), *read, anyway
    return NextStep(f"{capital(match.text)}.", Tone.BAD, change, anyway, more=tuple(more))


def _inverted(how: str, match: ArmMatch) -> str:
    """A reading that only inverts joints names all of them, as its own name has the first alone."""
    changes = match.meaning.choices[how].changes if match.meaning else ()
    joints = re.findall(r"joint (\d+) = -q\1(?=;|$)", "; ".join(changes))
    return f"joints {', '.join(joints)} inverted" if 1 < len(joints) == len(changes) else how


def _change_to(match: ArmMatch) -> Action:
    """To the built-in arm that the rows fit, with them; to choose one if none does."""
    if not match.rival:
        return OTHER_ARM
    return Action(f"Change to {match.rival}", Tab.CALIBRATE, ChooseRobot(match.rival, keep=True))


def _figure(session: Session) -> str:
    """Errors stage by stage, or what is predicted before there are any [mm]."""
    if found := stages(session):
        return f"{' → '.join(compared(stage.error) for stage in found)} mm"
    predicted = 1e3 * session.score.position
    is_plate = session.measurements.loaded is None and np.isfinite(predicted)
    return f"{predicted:.3f} mm predicted after calibration" if is_plate else ""


def _plate(session: Session) -> NextStep:
    """What the plate needs, or that it is good enough."""
    history, count = session.history, len(session.plate)
    improve = Action(ImprovePlate.title, Tab.PLATE, ImprovePlate(len(history.past)))
    if bad := [i for i, state in enumerate(session.states) if not state.measurable]:
        i = session.selected if session.selected in bad else bad[0]
        why = f"target {i + 1} is {session.states[i].obstacle}"
        show = Action(f"Show target {i + 1}", Tab.PLATE, SelectTarget(i))
        if i == session.selected and session.plate.targets[i].branch != AUTO:
            show = Action("Choose its branch anew", Tab.PLATE, ChooseBranch(i, AUTO))
        text = f"{count - len(bad)} of {count} targets can be measured; {why}."
        return NextStep(text, Tone.BAD, show, improve)
    if session.page.tab in (Tab.MEASURE, Tab.CALIBRATE, Tab.COMPARE, Tab.EXPORT):
        text = "Nothing has been measured yet. Load the rows of a real arm, or measure a virtual one."
        return NextStep(text, next=LOAD, other=PLATE)
    if met := overlapping_blocks(session.plate):
        is_known = history.best is not None and not overlapping_blocks(history.best.plate)
        return NextStep(f"{capital(met)}; move one of them.", Tone.BAD, BEST if is_known else improve, LOAD)
    judged, is_searched = plate_judgement(session), history.searched is session.plate
    if session.plate is history.first.plate and not is_searched and (judged is None or not history.done):
        text = "Drag an arrow to move the blue target, a ring to turn it; the arm follows"
        return NextStep(f"{text}. Or let the program place all targets.", next=improve, other=LOAD)
    if judged is not None and judged.tone is Tone.GOOD:
        return NextStep(f"{capital(judged.text)}. Make the plate, then measure.", Tone.GOOD, MAKE, LOAD)
    text = capital(_predicted(session)) + ("" if judged is None else f"; {judged.text}")
    is_known, trial = np.isfinite(session.score.position), None if judged is None else _trial()
    if is_known and (judged is None or judged.tone is Tone.PLAIN):
        is_worse = history.best is not None and history.best.score.position < session.score.position
        other = BEST if is_worse else LOAD if trial else improve
        return NextStep(f"{text}. Good enough?", next=trial or LOAD, other=other)
    if not is_searched:
        text = f"{text}. A search may find better places for the targets."
        return NextStep(text, Tone.CAREFUL, improve, LOAD if session.tried is None else MAKE)
    text = f"{text}. No better plate was found. Require less, measure more exactly, or add targets."
    return NextStep(text, Tone.CAREFUL, MAKE if is_known else LOAD, LOAD if is_known else None)


def _trial() -> Action | None:
    """The plate tried on virtual arms, where an extra does so."""
    found = next((kind for kind in kinds().values() if issubclass(kind, AbstractPlateTrial)), None)
    return None if found is None else Action("Try this plate", Tab.PLATE, found())


def _predicted(session: Session) -> str:
    now = 1e3 * session.score.position
    if np.isnan(now) and session.region.sampled is session.plate.region:
        return "the arm does not reach the region"
    if not np.isfinite(now):
        return f"the predicted error {'is unbounded' if np.isinf(now) else 'has not been computed yet'}"
    return f"predicted error after calibration {compared(now)} mm rms"
