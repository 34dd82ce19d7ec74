"""Diagnosis from end to end: a search for causes, the arm that is saved, what is claimed of it, advice."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Unpack

import numpy as np
from jaxtyping import Bool, Float, Int

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
from workbench.diagnosis.cause_search import CauseSearch, search_causes
from workbench.diagnosis.claims.cause import Cause, ResidualMap
from workbench.diagnosis.claims.claimed_causes import find_causes
from workbench.diagnosis.claims.named_joints import sentence_of
from workbench.diagnosis.claims.standard_errors import StandardErrors
from workbench.diagnosis.claims.structure import Structure, structure_of
from workbench.diagnosis.event_notes import Now, arm_now
from workbench.diagnosis.final_fit import fitted_on_all
from workbench.diagnosis.gravity_direction import standing_causes, standing_notes
from workbench.diagnosis.next_poses import Measurable, NextReason, next_poses
from workbench.diagnosis.result import Accepted, Diagnosis, Verdict, harm_done, judged
from workbench.diagnosis.rivals import Trial
from workbench.diagnosis.search.evidence import Model, drop
from workbench.diagnosis.search.flanks import open_flanks
from workbench.diagnosis.search.rounds import Searched
from workbench.diagnosis.undetectable import (
    Undetectable,
    describe,
    hidden_variance,
    open_flanks_text,
    undetectable,
)
from workbench.diagnosis.verdict import conclude, coverage, weights_that_differ
from workbench.identification import noise as noises
from workbench.identification.errors.row_errors import UNKNOWN, Errors, RowErrors, degradation_warning
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import ChoiceFields, FitChoices
from workbench.identification.joint_reading_noise import Readings, readings
from workbench.identification.own_preparation import preparation_of
from workbench.identification.problem import Noise
from workbench.identification.rows.exchanged_rows import exchange_note, exchanged_rows
from workbench.identification.rows.set_apart import (
    GROSS_REASON,
    prepare_without_gross_outliers,
    stand_out_note,
    suspect_note,
    suspects,
)
from workbench.plate.argument_types import checked_arguments

NO_DIRECTION = (
    "backlash that depends on the direction of motion was not tried: rows have neither times nor directions; "
    "add time[s] if they are in the order of measurement, or else direction1 …"
)

NO_PAYLOAD = (
    "no row has a payload: what gives way is sized as if the arm carried no more than its own links, and too "
    "large if there is a heavy tool; if so, add payload[kg]"
)


@checked_arguments(FitChoices)
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
        robot: Nominal arm; effects that it already has keep their values.
        data: Measurements, with any drivers of effects.
        choices: Rows and frames of the fit; its fields may be given as keywords, such as `held_out=0.2`.
        measurable: Whether a posture can be measured next; all reachable ones if None.

    Raises:
        DataError: too few rows, or data that contradict the robot beyond doubt.
        OptionError: an unknown constant or option.
    """
    if (own := preparation_of(data)) is not None:
        raise OptionError(f"{data.source}: {own.undiagnosed}")
    began, choices = perf_counter(), FitChoices.of(choices, **fields)
    massed, rng, advice = with_assumed_masses(robot), np.random.default_rng(choices.seed), Advice()
    with part_of(0.0, 0.3):
        ready, gross = prepare_without_gross_outliers(
            massed, with_directions(data), _with_directions(choices)
        )
    search = search_causes(massed, ready, rng)
    saved = _saved_arm(search, advice)
    claims = _claims(search, saved, given=robot, known=choices.noise, rng=rng, advice=advice)
    progress(0.9, "choosing poses to measure next")
    next_ones = _measured_next(search, saved, claims, rng=rng, measurable=measurable, advice=advice)
    result = _diagnosis(search, saved, claims, next_ones, given=robot, gross=gross, advice=advice)
    progress(1.0, "done")
    return replace(result, seconds=perf_counter() - began)


@dataclass(frozen=True, eq=False)
class _Saved:
    """The saved arm.

    Args:
        fit: The last model, refitted to all rows of the file except suspects; that of the last search if
            no row was held out, or if the refit did not converge.
        suspects: Which held-out rows no arm explains.
        note: Note on the refit; None without one.
        undetectable: Effects of load that are unobservable in the rows.
        std: Standard errors of the coefficients, with what undetectable effects may add.
        effects: Effects of the model, clearest first.
        trial: Computes the errors of other models.
        now: The event after which the saved arm is valid, and its error since; None without events.
    """

    fit: Fit
    suspects: Bool[np.ndarray, " held"]
    note: str | None
    undetectable: tuple[Undetectable, ...]
    std: StandardErrors
    effects: tuple[Accepted, ...]
    trial: Trial
    now: Now | None


@dataclass(frozen=True, eq=False)
class _Claims:
    """Claims of the diagnosis; fields as in `Diagnosis`."""

    causes: tuple[Cause, ...]
    residual_map: ResidualMap | None
    structure: Structure
    noise: Noise
    known_noise: Noise | None
    joint_noise: Readings | None
    verdict: Verdict
    message: str


def _saved_arm(search: CauseSearch, advice: Advice) -> _Saved:
    """The last round's arm fitted to all rows, with standard errors and rivals of its effects."""
    last, ready, geometry = search.rounds[-1], search.ready, search.first.fitted
    fit = last.stage.fitted.fit
    suspect_rows = suspects(ready, fit, geometry.problem.named(geometry.fit.x))
    final, note = fitted_on_all(ready, last, search.fit, suspect_rows)
    motion, trial = Motion.of(fit.problem.data), Trial(ready, last)
    missing = advice.ask(
        "unobservable effects", lambda: () if search.too_few else undetectable(last, fit.arm, motion), ()
    )
    std = StandardErrors(final, hidden_variance(last, missing))
    alone, after = (judged(v.errors) for v in (search.before, search.after))
    effects = _accepted(last, final, trial, std, advice, alone=alone, after=after)
    now = arm_now(final)
    return _Saved(final, suspect_rows, note, missing, std, effects, trial, now)


def _claims(
    search: CauseSearch,
    saved: _Saved,
    *,
    given: Robot,
    known: Noise | None,
    rng: np.random.Generator,
    advice: Advice,
) -> _Claims:
    """Causes, residual map, structure of the residuals, and the verdict.

    Args:
        given: The robot as given.
        known: Noise known beforehand.
    """
    last, ready = search.rounds[-1], search.ready
    fit, geometric = last.stage.fitted.fit, last.stage.geometric
    noise = noises.of_residual(fit.problem, fit.x, fit.factor) or geometric.noise
    known_noise = noises.stated(ready.problem) or known or noises.from_repeats(ready.problem.data)
    joint_noise = readings(fit.problem.with_noise(geometric.noise))
    tested: Structure | None = Structure()
    if search.too_few is None:
        tested = advice.ask("the structure of the residuals", lambda: structure_of(fit, rng), None)
    structure = tested or Structure()
    found = _found_causes(search, saved, known_noise, tested)
    causes = (*found, *standing_causes(saved.fit, given, noise))
    residual_map = _residual_map(last.found.model, saved.effects, causes, saved.trial, search)
    verdict, message = conclude(
        causes,
        residual_map,
        nominal=judged(search.nominal),
        reach=search.robot.reach,
        noise=noise,
        before=judged(search.before.errors),
        after=judged(search.after.errors),
        known_noise=known_noise,
        structure=structure,
        distrusted=last.found.distrusted,
        joint_noise=joint_noise,
        chain=search.robot.chain,
    )
    if search.too_few is not None:
        verdict, message = Verdict.NONE, search.too_few
    message = " ".join([message, *_additions(search, saved, advice)])
    return _Claims(causes, residual_map, structure, noise, known_noise, joint_noise, verdict, message)


def _found_causes(
    search: CauseSearch, saved: _Saved, known_noise: Noise | None, structure: Structure | None
) -> tuple[Cause, ...]:
    """The causes among the accepted effects."""
    if not saved.effects:
        return ()
    last = search.rounds[-1]
    motion = Motion.of(last.stage.fitted.problem.data)
    alone_mm, all_mm = (v.errors.train.position_mm.rms for v in (search.before, search.after))
    together_mm = float(np.sqrt(max(alone_mm**2 - all_mm**2, 0.0)))
    return find_causes(
        last, saved.fit.arm, motion, known_noise, saved.std, structure, together_mm=together_mm
    )


def _additions(search: CauseSearch, saved: _Saved, advice: Advice) -> Iterator[str]:
    """Sentences that follow the verdict: undecided flanks, degradation, which arm is saved."""
    if missing := advice.ask("undecided flanks", lambda: open_flanks(saved.fit), {}):
        yield open_flanks_text(missing, search.robot.chain)
    if worse := degradation_warning(_nominal_rows(search), search.after.rows):
        yield f"Warning: {worse}."
    if saved.effects and (worse := harm_done(search.before.rows[1], search.after.rows[1])):
        yield f"Warning: {worse}."
    if saved.now:
        yield saved.now.sentence


def _nominal_rows(search: CauseSearch) -> tuple[RowErrors, RowErrors]:
    """Errors of the nominal arm on the fitted rows without outliers, and on the held-out rows."""
    fitted, held = search.ready.nominal_rows
    return fitted.take(search.rounds[-1].stage.keep), held


def _measured_next(
    search: CauseSearch,
    saved: _Saved,
    claims: _Claims,
    *,
    rng: np.random.Generator,
    measurable: Measurable | None,
    advice: Advice,
) -> tuple[Float[np.ndarray, "_ n"], tuple[NextReason, ...]]:
    """Poses that reduce the uncertainty of accepted effects and separate them from look-alikes."""
    fit = search.rounds[-1].stage.fitted.fit
    requested = [a.effect for a in saved.effects] + [e for c in claims.causes for e in c.look_alikes]
    return advice.ask(
        "poses to measure next",
        lambda: next_poses(fit.problem, fit.x, requested, rng=rng, measurable=measurable),
        (np.zeros((0, search.robot.dof)), ()),
    )


def _notes(
    search: CauseSearch, saved: _Saved, outliers: Int[np.ndarray, " k"], given: Robot, advice: Advice
) -> Iterator[str]:
    """Notes for the user beside the verdict, one sentence each."""
    ready, last = search.ready, search.rounds[-1]
    fit, effects = last.stage.fitted.fit, [a.effect for a in saved.effects]
    chain = search.robot.chain
    yield from ready.notes
    yield from last.offered.notes
    yield from [] if search.too_few else coverage(fit.problem.data, chain)
    yield from (
        f"held out: {text}"
        for text in extrapolation_notes(effects, chain, ready.held_out_data.q, ready.held_out_data.row)
    )
    if saved.suspects.any():
        yield suspect_note(ready.held_out_data.row[saved.suspects].tolist(), judged(search.after.errors))
    others = ready.held_out_data.row[~saved.suspects]
    if far := stand_out_note(others, search.after.rows[1].position[~saved.suspects]):
        yield far
    if saved.note is not None:
        yield saved.note
    if search.too_few is None and saved.undetectable and any(e.loads for e in effects):
        yield describe(saved.undetectable)
    if pairs := advice.ask("exchanged rows", lambda: exchanged_rows(fit, ready.data, outliers), []):
        yield exchange_note(pairs)
    yield from weights_that_differ(saved.fit, given)
    yield from standing_notes(saved.fit, given)
    motion = Motion.of(fit.problem.data)
    yield from (text for e in effects if (text := e.caveat(motion)))
    if given.has_masses and motion.payload is None and any(e.loads for e in effects):
        yield NO_PAYLOAD
    if motion.direction is None:
        yield NO_DIRECTION


def _diagnosis(
    search: CauseSearch,
    saved: _Saved,
    claims: _Claims,
    next_ones: tuple[Float[np.ndarray, "_ n"], tuple[NextReason, ...]],
    *,
    given: Robot,
    gross: np.ndarray,
    advice: Advice,
) -> Diagnosis:
    """Compute the remaining fields and collect the result; `gross` are rows excluded before any fit."""
    ready, stage, fit = search.ready, search.rounds[-1].stage, search.fit
    outliers = np.union1d(gross, ready.train_rows[~stage.keep]).astype(np.int64)
    noise = claims.noise if fit.problem.sees_rotation else claims.noise._replace(rotation=np.nan)
    poses, reasons = next_ones
    texts = {c.effects[0].names: c.text for c in claims.causes if len(c.effects) == 1}
    return Diagnosis(
        nominal_robot=search.robot,
        data=ready.data,
        train_rows=ready.train_rows,
        held_out_rows=ready.held_out_rows,
        held_out_data=ready.held_out_data,
        new_sessions=ready.new_mountings(fit.calibrated),
        excluded=tuple(e for e in ready.excluded if e[1] != GROSS_REASON),
        outliers=outliers,
        outlier_errors=advice.ask(
            "the errors of outliers",
            lambda: (
                ready.errors_on(ready.data.take(outliers), fit.arm, fit.problem.instrument(fit.x)).summary
            ),
            None,
        ),
        suspects=np.flatnonzero(saved.suspects),
        nominal=search.nominal,
        before_fit=search.first.fitted.fit,
        after_fit=fit,
        final_fit=saved.fit,
        aligned=ready.aligned,
        nominal_rows=_nominal_rows(search),
        before=search.before.errors,
        after=search.after.errors,
        before_rows=search.before.rows,
        after_rows=search.after.rows,
        effects=tuple(replace(a, text=texts.get(a.effect.names, a.text)) for a in saved.effects),
        causes=claims.causes,
        residual_map=claims.residual_map,
        ranking=advice.ask("the ranking of candidates", Trial(ready, search.rounds[0]).ranking, ()),
        noise=noise,
        known_noise=claims.known_noise,
        joint_noise=claims.joint_noise,
        structure=claims.structure,
        now=saved.now,
        verdict=claims.verdict,
        message=claims.message,
        is_tried=search.too_few is None,
        undetectable=saved.undetectable,
        measure_next=poses,
        next_reasons=reasons,
        notes=tuple(_notes(search, saved, outliers, given, advice)),
        warnings=tuple(advice.warnings),
        seconds=0.0,
    )


def _residual_map(
    model: Model, accepted: Sequence[Accepted], causes: Sequence[Cause], trial: Trial, search: CauseSearch
) -> ResidualMap | None:
    """The accepted effects that are not causes, with their contribution beside the causes."""
    claimed = {e.names for c in causes for e in c.effects}
    others = tuple(a.effect for a in accepted if a.effect.names not in claimed)
    if not others:
        return None
    blamed = tuple(t for t in model if t.candidate.names in claimed)
    alone, after = (judged(v.errors) for v in (search.before, search.after))
    named = trial.refitted(blamed) if blamed else alone
    is_better = named.position_mm.mean < alone.position_mm.mean
    return ResidualMap(
        effects=others,
        before=named if is_better else alone,
        after=after,
        beside_causes=bool(blamed) and is_better,
    )


def _with_directions(choices: FitChoices) -> FitChoices:
    """The choices with directions of motion in held-out rows of another file."""
    rows = choices.held_out
    return replace(choices, held_out=with_directions(rows)) if isinstance(rows, Dataset) else choices


def _accepted(
    last: Searched,
    final: Fit,
    trial: Trial,
    std: StandardErrors,
    advice: Advice,
    *,
    alone: Errors,
    after: Errors,
) -> tuple[Accepted, ...]:
    """The effects of the last fit with standard errors, rivals and individual contributions.

    Args:
        last: The last search.
        final: Its model fitted to all rows.
        trial: Evaluates other models at that search.
        std: Standard errors of the coefficients [SI].
        advice: Computes rivals, and errors without each effect.
        alone: Errors of the geometry alone on the judging rows.
        after: Errors of the whole model on them.
    """
    sized = {e.names: e for e in final.arm.effects}
    model, out = last.found.model, []
    for k in sorted(range(len(model)), key=lambda k: -last.found.offers[k].gain):
        term, offered = model[k], last.found.offers[k]
        effect, rest = sized[term.candidate.names], drop(model, [term])
        without = f"the error without {effect.phrase}"
        alternatives = advice.ask(f"alternatives to {effect.phrase}", partial(trial.alternatives, term), ())
        out.append(
            Accepted(
                effect=effect,
                std=tuple(std[n] for n in effect.names),
                gain=offered.gain,
                p_value=float(np.exp(offered.log_p)),
                before=advice.ask(without, partial(trial.refitted, rest), UNKNOWN) if rest else alone,
                after=after,
                alternatives=alternatives,
                text=sentence_of(effect, (), std, final.arm, Motion.of(final.problem.data)),
            )
        )
    return tuple(out)
