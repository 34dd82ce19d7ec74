"""The search of a diagnosis: geometry alone, then rounds of events and effects until the result is confirmed.

Results are judged on rows that took no part in the search. It is repeated without uncertain events, under
another gravity if only that makes loads explain the error, and without anything if nothing explains much, or
if the joints' speed explains most: then joints and places are of different times.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from workbench.arm.chain import Axis
from workbench.arm.effects import AbstractEffect, Candidate
from workbench.arm.effects.base_drift import mixed_share
from workbench.arm.effects.effect import NO_WRENCHES
from workbench.arm.effects.events import WarmUp
from workbench.arm.effects.gravity_sag import GravitySag
from workbench.arm.frame import revised
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.arm.statics.deflection import shift_of
from workbench.arm.usable_arm import events_of, off_nominal
from workbench.base import se3
from workbench.base.advice import ask
from workbench.base.progress import progress
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.claims.claimed_causes import odds_over_time, undecided
from workbench.diagnosis.claims.standard_errors import clearness
from workbench.diagnosis.confidence import CERTAIN, PROBABLE, Confidence
from workbench.diagnosis.coverage import ONLY_LOADS, loads_vary, too_few_rows
from workbench.diagnosis.drivers.driver import MIN_MIXED, SESSION, Driver, driver_of
from workbench.diagnosis.drivers.evidence import DriverEvidence, evidence_of
from workbench.diagnosis.drivers.gravity import gravity_elsewhere
from workbench.diagnosis.drivers.path import path_of
from workbench.diagnosis.final_fit import fit_as_saved, geometry_as_identified
from workbench.diagnosis.result import harm_done
from workbench.diagnosis.search.contributions import remaining
from workbench.diagnosis.search.evidence import (
    NONZERO_ERRORS,
    Model,
    Term,
    coefficients,
    drop,
    is_nameless,
    left_of,
)
from workbench.diagnosis.search.refit import robot_with
from workbench.diagnosis.search.rounds import (
    Searched,
    Stage,
    Tried,
    description_length,
    geometry_first,
    reduced,
    refitted,
    rounds,
    under_gravity,
)
from workbench.diagnosis.search.stepwise_search import group_evidence
from workbench.identification.alignment import align
from workbench.identification.errors.row_errors import Errors, Validation, explains_little
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared
from workbench.identification.rows.row_selection import as_marked
from workbench.identification.run import SavedArm

UNDECIDED = "measured at a step: on which side is undecided"
SHORT = 0.25
"""Share of the reach from a joint to the measured point below which this hardly shows how the joint turns."""
LAST, MAX_WORSE = 0.25, 1.05
"""Share of the rows that are the last ones, and how much worse a law that is decided may make their error."""


@dataclass(frozen=True, eq=False)
class CauseSearch:
    """Result of the search.

    Args:
        robot: The nominal arm, with assumed masses where its file has none.
        ready: The rows, without held-out ones that may lie on either side of an event.
        first: The geometry alone.
        passes: The searches, each without some of what the one before it found.
        drivers: What the error follows at the final fit; None if too few rows tell.
        judged_fit: The last search's arm, as it is saved but for held-out rows.
        still: All rows as from a measuring frame at rest, if it moves by no law; arms are fitted to them.
        too_few: Why no search was made; None if one was.
        nominal: Errors of the nominal arm, with the best base and tool, on the fitted rows that are no
            outliers, and on the held-out rows.
        before: Errors of the geometry on the same rows.
        after: Errors of that arm on the same rows.
    """

    robot: Robot
    ready: Prepared
    first: Stage
    passes: Sequence[Searched]
    drivers: DriverEvidence | None
    judged_fit: Fit
    still: Dataset | None
    too_few: str | None
    nominal: Validation
    before: Validation
    after: Validation

    @property
    def last(self) -> Searched:
        """The last search, at the final fit to the fitted rows."""
        return self.passes[-1]

    def errors(self, model: Model, rows: Dataset | None = None) -> Errors:
        """Of the geometry with a model's effects, by the linear solution at the fit, on the judging rows or
        others."""
        fit = self.last.stage.fit
        data = rows or self.ready.held_out_data or fit.problem.data
        arm = robot_with(fit, self.last.grams, model)
        return self.ready.errors_on(data, arm, fit.problem.instrument(fit.x))

    def _is_over(self, model: Model, term: Term, worse: float) -> bool:
        """Whether the last rows are better without a law, which may have ceased; arms are saved for later."""
        data = self.last.stage.problem.data
        clock = clock_of(data)[0]
        if term.candidate.effect.is_event or mixed_share(data.q, clock) <= MIN_MIXED:
            return False  # where postures come in an order, the last rows may differ by these alone
        late = data.take(np.flatnonzero(clock >= np.quantile(clock, 1.0 - LAST)))
        return self._is_worse(self.errors(drop(model, [term]), late), self.errors(model, late), worse)

    def _is_unseen(self, term: Term) -> bool:
        """Whether a term turns the flange, where nobody measures how it is turned, more than all constants do
        and than an error of its size at the measured point usually does."""
        fit, motion = self.last.stage.fit, self.last.stage.motion
        if fit.problem.sees_rotation:
            return False
        mine = tuple(e for e in fit.arm.effects if e.names == term.candidate.names)
        alone = revised(fit.arm, effects=mine)
        turn = float(np.sqrt(shift_of(alone, motion)[:, alone.chain.axes < Axis.TX].var(0).sum()))
        without, whole = remaining(self.last, [drop(self.last.model, [term]), self.last.model])[:, 0]
        seen = 1e-3 * np.sqrt(max(without**2 - whole**2, 0.0)) / (SHORT * self.robot.reach)
        by_geometry = off_nominal(self.first.fit.arm, self.robot, motion.q).rotation
        return turn > max(seen, by_geometry)

    def _is_worse(self, old: Errors, new: Errors, worse: float) -> bool:
        """Whether some errors are larger than others on the same rows, beyond chance or by a factor."""
        is_harm = harm_done(old, new, self.last.stage.geometric_problem.noise) is not None
        return is_harm or new.main.mean > worse * old.main.mean

    def lasting(self) -> Model:
        """The last model without what is of no use for other rows.

        The arm after a warm-up that any smooth function of the time explains as well is that function beyond
        its rows, which nobody knows. What has no name, or no law that wins, must predict the rows that judge
        it; no model may make these worse than geometry alone, beyond chance or by more than a law may.
        """
        model, drivers = self.last.model, self.drivers
        if not model or drivers is None:
            return model
        warm = [t for t in model if isinstance(t.candidate.effect, WarmUp)]
        caps = [challenge.cap for challenge in drivers.challenges([(t,) for t in warm])]
        if lost := [t for t, cap in zip(warm, caps, strict=True) if cap <= 1.0]:
            return drop(model, lost)
        kept = drivers.lasting(unsure := undecided(drivers))
        kept = drop(kept, [t for t in kept if (t in unsure or is_nameless(t)) and self._is_unseen(t)])
        gone = [t for t in kept if self._is_over(kept, t, 1.0 if t in unsure else MAX_WORSE)]
        if gone or len(kept) < len(model):
            return drop(kept, gone)
        nameless, after = [*filter(is_nameless, kept)], self.after.judged
        fewer = {(): MAX_WORSE} | {drop(kept, some): 1.0 for some in (nameless, [*nameless, *unsure])}
        left = {m: self.errors(m) if m else self.before.judged for m in fewer if len(m) < len(model)}
        better = [m for m, errors in left.items() if self._is_worse(errors, after, fewer[m])]
        return min(better, key=lambda m: left[m].main.mean, default=kept)


def search_causes(robot: Robot, ready: Prepared, rng: np.random.Generator) -> CauseSearch:
    """Fit the geometry, then search for effects; a result that explains next to nothing means a wrong arm."""
    progress(0.3, "fitting the geometry, excluding outliers")
    first = geometry_first(ready.problem)
    too_few, events = too_few_rows(first.fit), None
    tried: Tried | None = (lambda effect: True) if too_few is None else None
    if too_few is not None and loads_vary(first.fit.problem.data):
        ready, too_few = replace(ready, notes=(*ready.notes, ONLY_LOADS)), None
        tried, events = (lambda effect: bool(effect.loads) or isinstance(effect, GravitySag)), ()
    validated = partial(_validated_search, robot, ready, first, too_few)
    path = path_of(first.problem.data, ready.data)
    if too_few is None and path is not None and path.course.is_steady:
        alone = validated([rounds(first, rng, tried=None)])
        if ask("a lag", lambda: alone.drivers is not None and alone.drivers.is_lag, False):
            return alone
    try:
        found = _rounds_with_sure_events(first, rng, tried, events)
    except np.linalg.LinAlgError:  # models beyond rounding, of rows that are far from any arm
        found = [rounds(first, rng, tried=None)]
    progress(0.8, "judging the result")
    search = validated(found)
    drivers = search.drivers
    if drivers is not None and (pull := ask("gravity", lambda: gravity_elsewhere(drivers), None)) is not None:
        turned = validated(_rounds_with_sure_events(under_gravity(first, pull), rng, tried, events))
        gain = description_length(search.last) - description_length(turned.last)
        search = turned if gain > np.log(CERTAIN) and _shows_gravity(turned) else search
    if explains_little(search.nominal.train, search.after.train, robot.reach):
        search = validated([rounds(first, rng, tried=None)])
    return search


def _shows_gravity(search: CauseSearch) -> bool:
    """Whether a law of load is clear, as gravity is seen through it alone, and such laws explain more than a
    pull on the tool does."""
    if (drivers := search.drivers) is None:
        return False
    fit, model = search.last.stage.fit, search.last.model
    sure = drop(model, (*undecided(drivers), *filter(is_nameless, model)))
    laws = tuple(t for t in sure if driver_of(t.candidate.effect) is Driver.LOAD)
    names = {t.candidate.names for t in laws}
    sizes = clearness([e for e in fit.arm.effects if e.names in names], fit.problem.named(fit.std)).values()
    if max(sizes, default=0.0) < NONZERO_ERRORS:
        return False
    left = left_of(drivers.grams, drop(sure, laws))
    return group_evidence(left, laws) > evidence_of(left, drivers.pulls) + np.log(CERTAIN)


def _rounds_with_sure_events(
    first: Stage, rng: np.random.Generator, tried: Tried | None, events: Sequence[Candidate] | None
) -> list[Searched]:
    """The search for events and effects, taken up again without uncertain events and drifts.

    Consecutive rows often have similar postures, so an event that is less than certain may be an effect of
    posture; and what follows the time by no law is no law for the time to come.
    """
    found, refused = [rounds(first, rng, tried=tried, events=events)], set[str]()

    def tried_still(effect: AbstractEffect) -> bool:
        return tried is not None and tried(effect) and effect.name not in refused

    while odds := odds_over_time(found[-1]):
        unsure = [candidate for candidate, its_odds in odds.items() if its_odds < PROBABLE]
        if not unsure:
            break
        events = [c for c in odds if c.effect.is_event and c not in unsure]
        refused |= {c.effect.name for c in unsure if not c.effect.is_event}
        rest = [t for t in found[-1].model if t.candidate not in unsure]
        found.append(rounds(refitted(found[-1], rest), rng, tried=tried_still, events=events))
    return found


def _validated_search(
    robot: Robot, ready: Prepared, first: Stage, too_few: str | None, found: Sequence[Searched]
) -> CauseSearch:
    """A search, refitted until it is without what is of no use for other rows, with its errors on rows that
    lie on a known side of its events, and of all arms on the same rows: without outliers."""
    still, drivers = None, None
    while True:
        last, rows = found[-1], without_undecided(ready, found[-1])
        if drivers is None and too_few is None:
            drivers = ask("the drivers", partial(DriverEvidence.of, last, ready.data), None)
        fit, keep, geometry = fit_as_saved(last, still), last.stage.keep, first.fit
        if not last.model:
            geometry = fit = geometry_as_identified(fit, rows.problem.noise if keep.all() else None)
        fit = ready.scaled(fit)
        arms = ((f.arm, {**f.problem.known, **f.problem.instrument(f.x)}) for f in (geometry, fit))
        if not (own := rows.problem.frames).levelled and not keep.all():  # outliers place no base
            rows = replace(rows, aligned=align(rows.aligned, rows.problem.data.take(keep), own))
        errors = (rows.nominal, *(rows.errors(*arm) for arm in arms))
        judged = (Validation(e.train.take(keep), e.held_out) for e in errors)
        search = CauseSearch(robot, rows, first, found, drivers, fit, still, too_few, *judged)
        if still is not None or drivers is None:
            return search
        kept = ask("what lasts", search.lasting, last.model)
        if len(kept) < len(last.model):
            found, drivers = (*found, reduced(last, kept)), None
        elif (still := ask("a frame at rest", partial(_at_rest, drivers, ready.data), None)) is None:
            return search


def without_undecided(ready: Prepared, last: Searched) -> Prepared:
    """The rows without held-out ones between the last row before a step and the first one after it.

    Only these rows themselves could show on which side of the step they lie.
    """
    held, fitted = Motion.of(ready.held_out_data), Motion.of(last.stage.problem.data)
    between = np.zeros(len(ready.held_out_data), bool)
    for event in events_of(last.stage.fit.arm):
        here, there = event.clock(held), event.clock(fitted)
        if event.is_step and (there < event.moment).any():
            between |= (here > there[there < event.moment].max()) & (here < event.moment)
    undecided = dict.fromkeys(np.flatnonzero(between).tolist(), UNDECIDED)
    return as_marked(ready, ready.held_out_data.kept_out(undecided))


def _at_rest(drivers: DriverEvidence, rows: Dataset) -> Dataset | None:
    """Rows of the file as from a measuring frame at rest, where it is on average after all events:
    without what moves it over time by no law; None if nothing does."""
    over = [f for f in drivers.rest if f.driver is Driver.TIME]
    sure = (p for f in over if f.confidence is not Confidence.OPEN for p in f.parts)
    parts = [p for p in sure if p.part == "frame" and not p.phrase.startswith(SESSION)]
    if rows.position is None or not parts:
        return None
    arm, whole, (clock, row) = drivers.searched.stage.fit.arm, drivers.with_parts(parts), drivers.clock
    sizes, motion = coefficients(whole.grams, whole.model), Motion(np.zeros((len(row), arm.dof)), row=row)
    laws = [(p.candidate.effect.law(arm.chain, motion, NO_WRENCHES), p.candidate.names) for p in parts]
    known = np.sum([law @ [sizes[name] for name in names] for law, names in laws], axis=0)
    order, here = np.argsort(clock), clock_of(rows)[0]
    off = np.stack([np.interp(here, clock[order], part[order]) for part in known.T], 1)
    base, is_now = np.empty((len(rows), 4, 4)), SavedArm(arm, rows).is_now(rows)
    is_common = not drivers.problem.frames.base_per_session
    for name in rows.sessions:
        mine = rows.in_session(name)
        base[mine] = arm.in_session(name).base.pose
        off[mine] -= np.average(off, 0, (mine | is_common) * np.where(is_now, 1.0, 1e-9))
    turned = base[:, :3, :3] @ se3.rotvec_to_matrix(off[:, 3:])
    back = base @ se3.inverse(se3.pose(turned, base[:, :3, 3] + off[:, :3]))
    rotation = None if rows.rotation is None else back[:, :3, :3] @ rows.rotation
    return replace(rows, position=se3.apply(back, rows.position), rotation=rotation)
