"""The model that a diagnosis saves: fitted to all rows, its effects with standard errors and rivals; other
models on the judging rows."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool

from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import events_of
from workbench.base.advice import ask, beside
from workbench.diagnosis.cause_search import CauseSearch
from workbench.diagnosis.claims.accepted_terms import distinct, place_of
from workbench.diagnosis.claims.standard_errors import StandardErrors, sentence_of
from workbench.diagnosis.final_fit import fitted_on_all, identified
from workbench.diagnosis.result import Accepted, Now, Ranked
from workbench.diagnosis.search.evidence import Offer, Term, drop, own_offers
from workbench.identification.errors.row_errors import UNKNOWN, row_errors
from workbench.identification.fit import Fit
from workbench.identification.problem import Noise
from workbench.identification.rows.excluded_outliers import suspects
from workbench.identification.run import SavedArm

MAX_LISTED_RIVALS = 3
"""Maximum number of rivals listed for an effect."""
MIN_RELATIVE_EVIDENCE = 0.5
"""Minimum evidence of a rival relative to the effect's to be listed …"""
MAX_EVIDENCE_GAP = 100.0
"""… and maximum difference between the two."""


@dataclass(frozen=True, eq=False)
class SavedModel:
    """The model that is saved, and how well it is known.

    Args:
        fit: The last model, refitted to all rows of the file except suspects; that of the last search if
            no row was held out, or if the refit did not converge.
        suspects: Which held-out rows no arm explains.
        note: Note on the refit; None without one.
        std: Standard errors of the coefficients.
        effects: Effects of the model, clearest first.
        now: The event after which the saved arm is valid, and its error since; None without events.
    """

    fit: Fit
    suspects: Bool[np.ndarray, " held"]
    note: str | None
    std: StandardErrors
    effects: tuple[Accepted, ...]
    now: Now | None


def saved_model(search: CauseSearch) -> SavedModel:
    """The last round's arm fitted to all rows, with standard errors and rivals of its effects."""
    last, ready, geometry = search.last, search.ready, search.first.fit
    suspect_rows = suspects(ready, last.stage.fit, geometry.problem.named(geometry.x))
    final, note = fitted_on_all(ready, last, search.judged_fit, suspect_rows, search.still)
    effects = _accepted(search, final, std := StandardErrors(final))
    final = ready.scaled(final)
    return SavedModel(final, suspect_rows, note, std, effects, arm_now(final))


def best_geometry(fit: Fit, noises: Iterable[Noise]) -> Robot | None:
    """The arm without effects that leaves least of the rows; None if the fit has none but events, after which
    the arm has none.

    Either fitted to them as `identify` does, beside the events, or to the predictions of the arm with
    effects. Masses and gravity are as given: they were unknowns for the sake of the effects of load alone.
    Rows may be weighed by what geometry leaves, and as before any search.
    """
    problem, arm = fit.problem, fit.calibrated
    events = events_of(arm)
    if len(events) == len(arm.effects):
        return None
    angles = (p for p in problem.parameters if p.name.startswith("gravity"))
    given = problem.robot if all(p.is_inertia for p in angles) else arm
    saved, known = SavedArm(arm, problem.data), {**problem.known, **problem.instrument(fit.x)}
    rows, bare = saved.valid_for(problem.data), problem.robot.with_effects(*events)
    plain = problem.again(robot=bare, effects=[n for e in events for n in e.names], inertia=False)
    fits = [identified(plain.with_noise(noise)) for noise in dict.fromkeys(noises)]
    fitted, left = [SavedArm(fit.calibrated, problem.data).robot for fit in fits], {}
    for geometry in (g.weighed_as(given) for g in (*fitted, saved.formats["URDF"])):
        left[geometry] = SavedArm(arm.recorded(geometry=geometry), rows, known).errors(rows)["URDF"].main.rms
    return min(left, key=left.__getitem__)


def _accepted(search: CauseSearch, final: Fit, std: StandardErrors) -> tuple[Accepted, ...]:
    """The effects of the last fit with standard errors, rivals and individual contributions."""
    sized = {e.names: e for e in final.arm.effects}
    model, out = search.last.model, []
    unknown = [Offer(term, np.nan) for term in model]
    gains = ask("what each effect adds", lambda: own_offers(search.last.grams, model), unknown)
    for term, offered in sorted(zip(model, gains, strict=True), key=lambda each: -each[1].gain):
        effect, rest = sized[term.candidate.names], drop(model, [term])
        without = f"the error without {effect.phrase}"
        alternatives = ask(f"alternatives to {effect.phrase}", partial(_alternatives, search, term), ())
        out.append(
            Accepted(
                effect=effect,
                std=tuple(std[n] for n in effect.names),
                gain=offered.gain,
                before=ask(without, partial(search.errors, rest), UNKNOWN) if rest else search.before.judged,
                alternatives=alternatives,
                text=sentence_of(effect, (), std, final.arm, Motion.of(final.problem.data)),
            )
        )
    return tuple(out)


def _alternatives(search: CauseSearch, term: Term) -> tuple[Ranked, ...]:
    """The best candidates for the place of a term of the last model, with the error that remains."""
    place = place_of(search.last, (term,))
    minimum = max(MIN_RELATIVE_EVIDENCE * place.own, place.own - MAX_EVIDENCE_GAP)
    near = distinct([o for o in place.offers if o.gain > minimum])[:MAX_LISTED_RIVALS]
    whole = ((o, search.errors((*place.left.model, o.term))) for o in near)
    return tuple(Ranked(o.term.candidate.effect, o.gain, errors) for o, errors in whole)


@beside("the error after the last event", None)
def arm_now(final: Fit) -> Now | None:
    """The saved arm and its errors; None without events."""
    if not events_of(final.arm):
        return None
    problem = final.problem
    saved = SavedArm(final.calibrated, problem.data, {**problem.known, **problem.instrument(final.x)})
    rows = saved.valid_for(problem.data.take(saved.is_now(problem.data)))
    return Now(saved.events[-1].row, row_errors(saved.robot, rows, known=saved.known).position_mm.mean)
