"""Diagnosis from end to end: geometry, outliers, effects, verdict, what to measure next."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import NamedTuple, Unpack

import numpy as np

from workbench.arm.effects import extrapolation_notes
from workbench.arm.masses import with_assumed_masses
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base.advice import Advice
from workbench.base.errors import OptionError
from workbench.base.progress import part_of, progress
from workbench.base.threads import one_thread
from workbench.data.dataset import Dataset
from workbench.data.directions import with_directions
from workbench.diagnosis.claimed_causes import (
    CERTAIN,
    PROBABLE,
    Cause,
    ResidualMap,
    find_causes,
    odds_of_events,
)
from workbench.diagnosis.event_notes import arm_now, without_undecided
from workbench.diagnosis.evidence import Model, drop
from workbench.diagnosis.final_fit import fitted_on_all
from workbench.diagnosis.next_poses import Measurable, next_poses
from workbench.diagnosis.result import Accepted, Diagnosis, Verdict, harm_done, judged
from workbench.diagnosis.rounds import Searched, Stage, geometry_first, rounds
from workbench.diagnosis.standing import standing_causes, standing_notes
from workbench.diagnosis.structure import Structure, structure_of
from workbench.diagnosis.trial import Trial
from workbench.diagnosis.undetectable import describe, hidden_variance, undetectable
from workbench.diagnosis.verdict import conclude, coverage, explains_little, too_few_rows, weights_that_differ
from workbench.identification import noise as noises
from workbench.identification.exchanged_rows import exchange_note, exchanged_rows
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import ChoiceFields, FitChoices
from workbench.identification.joint_reading_noise import readings
from workbench.identification.own_preparation import preparation_of
from workbench.identification.preparation import Prepared
from workbench.identification.problem import Noise
from workbench.identification.result import Validation
from workbench.identification.row_errors import Errors, RowErrors, degradation_warning
from workbench.identification.set_apart import (
    GROSS_REASON,
    prepare_without_gross_outliers,
    suspect_note,
    suspects,
)
from workbench.plate.door import door

LOST = 1.5
"""Times the error of the geometry on the fitted rows from which on a fit with effects went astray."""


@door(FitChoices)
@one_thread()
def diagnose(
    robot: Robot,
    data: Dataset,
    choices: FitChoices | None = None,
    *,
    measurable: Measurable | None = None,
    **fields: Unpack[ChoiceFields],
) -> Diagnosis:
    """Find the effects that the model of an arm lacks, add them, and validate them on held-out rows.

    Args:
        robot: Nominal arm; effects that it carries already act as they are.
        data: Measurements, with whatever may drive an effect.
        choices: Rows and frames of the fit; its fields may be given as keywords, such as `held_out=0.2`.
        measurable: Tells which postures can be measured next; all that the arm can take if None.

    Raises:
        DataError: too few rows, or data that contradict the robot beyond doubt.
        OptionError: an unknown constant or option.
    """
    if (own := preparation_of(data)) is not None:
        raise OptionError(f"{data.source}: {own.undiagnosed}")
    choices, robot_as_given = FitChoices.of(choices, **fields), robot
    robot = with_assumed_masses(robot)
    began = perf_counter()
    with part_of(0.0, 0.3):
        ready, gross = prepare_without_gross_outliers(robot, with_directions(data), _with_directions(choices))
    rng = np.random.default_rng(choices.seed)
    search = _search(robot, ready, rng)
    return _build_diagnosis(
        robot,
        search.ready,
        search,
        choices.noise,
        rng,
        gross=gross,
        began=began,
        measurable=measurable,
        robot_as_given=robot_as_given,
    )


class _Judged(NamedTuple):
    """An arm on the fitted rows and on the held-out ones."""

    errors: Validation
    rows: tuple[RowErrors, RowErrors]


@dataclass(frozen=True, eq=False)
class _CauseSearch:
    """What was fitted.

    Args:
        ready: The rows, without held-out ones that don't tell on which side of an event they lie.
        first: The geometry alone.
        rounds: The searches, from the first to the last.
        short: Why none was made; None if one was.
        before: The geometry on the rows that judge.
        after: The last round's arm on them.
        nominal: The nominal arm on them.
    """

    ready: Prepared
    first: Stage
    rounds: Sequence[Searched]
    short: str | None
    before: _Judged
    after: _Judged
    nominal: Validation

    @property
    def is_lost(self) -> bool:
        """Whether the fit with what was found ended far above the geometry alone, which it contains."""
        before, after = (v.errors.train.position_mm.rms for v in (self.before, self.after))
        return bool(after > LOST * before)


def _search(robot: Robot, ready: Prepared, rng: np.random.Generator) -> _CauseSearch:
    """Fit the geometry, then look for effects; what then explains next to nothing is the wrong robot's."""
    progress(0.3, "fitting the geometry, setting outliers apart")
    first = geometry_first(ready.problem)
    short = too_few_rows(first.fitted.fit)
    found = _rounds_with_sure_events(first, rng) if short is None else rounds(first, rng, search=False)
    progress(0.8, "judging what was found")
    search = _validated_search(ready, first, found, short)
    if search.is_lost:
        search = _validated_search(ready, first, rounds(first, rng, events=()), short)
    if search.is_lost or explains_little(search.nominal.train, search.after.errors.train, robot.reach):
        search = _validated_search(ready, first, rounds(first, rng, search=False), short)
    return search


def _rounds_with_sure_events(first: Stage, rng: np.random.Generator) -> tuple[Searched, ...]:
    """The search for events and effects, made again without the events that it doubts.

    Rows in an order of their own look alike, so where they still do nothing less than certain happened.
    """
    found = rounds(first, rng)
    while odds := odds_of_events(found[-1]):
        needed = PROBABLE
        if min(odds.values()) < CERTAIN and structure_of(found[-1].stage.fitted.fit, rng).found:
            needed = CERTAIN
        sure = [event for event, its_odds in odds.items() if its_odds >= needed]
        if len(sure) == len(odds):
            break
        found = rounds(first, rng, events=sure)
    return found


def _validated_search(
    ready: Prepared, first: Stage, found: Sequence[Searched], short: str | None
) -> _CauseSearch:
    """What was found, with its errors on the rows that are on a known side of its events."""
    ready = without_undecided(ready, found[-1])
    before, after = _validated(ready, first), _validated(ready, found[-1].stage)
    return _CauseSearch(ready, first, found, short, before, after, _nominal(ready))


def _build_diagnosis(
    robot: Robot,
    ready: Prepared,
    search: _CauseSearch,
    noise: Noise | None,
    rng: np.random.Generator,
    *,
    gross: np.ndarray,
    began: float,
    measurable: Measurable | None,
    robot_as_given: Robot,
) -> Diagnosis:
    """The effects with what they add, the verdict, and what to measure next."""
    last = search.rounds[-1]
    fit = last.stage.fitted.fit
    geometry = search.first.fitted
    suspect_rows = suspects(ready, last.stage.fitted.fit, geometry.problem.named(geometry.fit.x))
    final, refit_note = fitted_on_all(ready, last, suspect_rows)
    before, after = judged(search.before.errors), judged(search.after.errors)
    is_short = search.short is not None
    motion, judge, advice = Motion.of(fit.problem.data), Trial(ready, last), Advice()
    missing = advice.ask(
        "what the rows can't show", lambda: () if is_short else undetectable(last, fit.calibrated, motion), ()
    )
    std = _standard_errors(final, hidden_variance(last, missing))
    accepted = _accepted(
        last, final, judge, std, advice, alone_mm=before.position_mm.mean, after_mm=after.position_mm.mean
    )
    joint_noise = readings(fit.problem.with_noise(last.stage.geometric.noise))
    floor = noises.stated(ready.problem) or noise or noises.from_repeats(ready.problem.data)
    residual_noise = noises.of_residual(fit.problem, fit.x, fit.factor) or last.stage.geometric.noise
    alone_mm, all_mm = (v.errors.train.position_mm.rms for v in (search.before, search.after))
    together_mm = float(np.sqrt(max(alone_mm**2 - all_mm**2, 0.0)))
    causes = (
        find_causes(last, final.calibrated, motion, floor, std, together_mm=together_mm) if accepted else ()
    )
    causes = (*causes, *standing_causes(final, robot_as_given, residual_noise))
    residual_map = _residual_map(last.found.model, accepted, causes, judge, search)
    structure = (
        Structure()
        if is_short
        else advice.ask("the structure of what is left", lambda: structure_of(fit, rng), Structure())
    )
    verdict, message = conclude(
        causes,
        residual_map,
        nominal=judged(search.nominal),
        reach=robot.reach,
        noise=residual_noise,
        before=before,
        after=after,
        floor=floor,
        structure=structure,
        distrusted=last.found.distrusted,
        joint_noise=joint_noise,
        chain=robot.chain,
    )
    if search.short is not None:
        verdict, message = Verdict.NONE, search.short
    elif missing and any(a.effect.loads for a in accepted):
        message = f"{message} {describe(missing)}"
    fitted, held = ready.nominal_rows
    if worse := degradation_warning((fitted.take(last.stage.keep), held), search.after.rows):
        message = f"{message} Warning: {worse}."
    if accepted and (worse := harm_done(search.before.rows[1], search.after.rows[1])):
        message = f"{message} Warning: {worse}."
    progress(0.9, "choosing poses to measure next")
    requested = [e.effect for e in accepted] + [e for c in causes for e in c.look_alikes]
    seen = [] if is_short else coverage(fit.problem.data, robot.chain)
    beyond = extrapolation_notes([a.effect for a in accepted], robot.chain, ready.held.q, ready.held.row)
    notes = [*ready.notes, *last.offered.notes, *seen, *(f"held out: {text}" for text in beyond)]
    if suspect_rows.any():
        notes.append(suspect_note(ready.held.row[suspect_rows].tolist(), after))
    if refit_note is not None:
        notes.append(refit_note)
    outliers = np.union1d(gross, ready.train_rows[~last.stage.keep]).astype(np.int64)
    if pairs := advice.ask("exchanged rows", lambda: exchanged_rows(fit, ready.data, outliers), []):
        notes.append(exchange_note(pairs))
    if now := arm_now(ready, final, suspect_rows):
        message = f"{message} {now.sentence}"
    keep, (fitted, held) = last.stage.keep, ready.nominal_rows
    poses, reasons = advice.ask(
        "poses to measure next",
        lambda: next_poses(fit.problem, fit.x, requested, rng=rng, measurable=measurable),
        (np.zeros((0, robot.dof)), ()),
    )
    ranking = advice.ask("the ranking of candidates", Trial(ready, search.rounds[0]).ranking, ())
    result = Diagnosis(
        nominal_robot=robot,
        data=ready.data,
        train_rows=ready.train_rows,
        held_out_rows=ready.held_out_rows,
        held_out_data=ready.held,
        excluded=tuple(e for e in ready.excluded if e[1] != GROSS_REASON),
        outliers=outliers,
        suspects=np.flatnonzero(suspect_rows),
        nominal=search.nominal,
        before_fit=search.first.fitted.fit,
        after_fit=fit,
        final_fit=final,
        aligned=ready.aligned,
        nominal_rows=(fitted.take(keep), held),
        before=search.before.errors,
        after=search.after.errors,
        before_rows=search.before.rows,
        after_rows=search.after.rows,
        effects=accepted,
        causes=causes,
        residual_map=residual_map,
        ranking=ranking,
        noise=residual_noise if fit.problem.sees_rotation else residual_noise._replace(rotation=np.nan),
        floor=floor,
        joint_noise=joint_noise,
        structure=structure,
        now=now,
        verdict=verdict,
        message=message,
        undetectable=missing,
        measure_next=poses,
        next_reasons=reasons,
        notes=(
            *notes,
            *weights_that_differ(final, robot_as_given),
            *standing_notes(final, robot_as_given),
            *(c for a in accepted if (c := a.effect.caveat(motion))),
        ),
        warnings=tuple(advice.warnings),
        seconds=perf_counter() - began,
    )
    progress(1.0, "done")
    return result


def _residual_map(
    model: Model, accepted: Sequence[Accepted], causes: Sequence[Cause], judge: Trial, search: _CauseSearch
) -> ResidualMap | None:
    """The accepted effects that are no causes, with what they add to those that are."""
    claimed = {e.names for c in causes for e in c.effects}
    others = tuple(a.effect for a in accepted if a.effect.names not in claimed)
    if not others:
        return None
    blamed = tuple(t for t in model if t.candidate.names in claimed)
    before, after = (judged(v.errors).position_mm.mean for v in (search.before, search.after))
    return ResidualMap(
        effects=others, before_mm=judge.refitted_mm(blamed) if blamed else before, after_mm=after
    )


def _with_directions(choices: FitChoices) -> FitChoices:
    """The choices with directions of motion in held-out rows of another file."""
    rows = choices.held_out
    return replace(choices, held_out=with_directions(rows)) if isinstance(rows, Dataset) else choices


def _nominal(ready: Prepared) -> Validation:
    """Errors of the nominal arm with the best base and tool."""
    fitted, held = ready.nominal_rows
    return Validation(Errors.of(fitted), held.summary)


def _validated(ready: Prepared, stage: Stage) -> _Judged:
    """Errors on the fitted rows, outliers left out, and on the held-out rows."""
    fit = stage.fitted.fit
    arm = fit.calibrated
    train, held = replace(ready, problem=fit.problem).errors(arm, fit.problem.instrument(fit.x))
    return _Judged(Validation(Errors.of(train), held.summary), (train, held))


def _standard_errors(fit: Fit, hidden: Mapping[str, float]) -> dict[str, float]:
    """Of the unknowns, with what else adds to the variance of each [SI]."""
    std = fit.problem.named(fit.std)
    return {name: float(np.hypot(s, np.sqrt(hidden.get(name, 0.0)))) for name, s in std.items()}


def _accepted(
    last: Searched,
    final: Fit,
    judge: Trial,
    std: Mapping[str, float],
    advice: Advice,
    *,
    alone_mm: float,
    after_mm: float,
) -> tuple[Accepted, ...]:
    """The effects of the last fit with their standard errors, rivals, and what each brings.

    Args:
        last: The last search.
        final: Its model on all rows.
        judge: Tries models out at that search.
        std: Standard errors of the coefficients [SI].
        advice: Asks for rivals, and for the errors without each effect.
        alone_mm: Mean error of the geometry alone on the rows that judge [mm].
        after_mm: Mean error of the whole model on them [mm].
    """
    sized = {e.names: e for e in final.calibrated.effects}
    model, out = last.found.model, []
    for k in sorted(range(len(model)), key=lambda k: -last.found.offers[k].gain):
        term, offered = model[k], last.found.offers[k]
        effect, rest = sized[term.candidate.names], drop(model, [term])
        without = f"the error without {effect.phrase}"
        alternatives = advice.ask(f"alternatives to {effect.phrase}", partial(judge.alternatives, term), ())
        out.append(
            Accepted(
                effect=effect,
                std=tuple(std[n] for n in effect.names),
                gain=offered.gain,
                p_value=float(np.exp(offered.log_p)),
                before_mm=advice.ask(without, partial(judge.refitted_mm, rest), np.nan) if rest else alone_mm,
                after_mm=after_mm,
                alternatives=alternatives,
                text=effect.sentence(final.calibrated.chain, Motion.of(final.problem.data)),
            )
        )
    return tuple(out)
