"""The search of a diagnosis: geometry alone, then rounds of events and effects until the result is confirmed.

Results are judged on rows that took no part in the search. It is repeated without uncertain events, under
another gravity if only that makes loads explain the error, and without anything if nothing explains much, or
if the joints' speed explains most: then joints and places are of different times.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from workbench.arm.effects.base_drift import mixed_share
from workbench.arm.effects.events import WarmUp
from workbench.arm.robot import Robot
from workbench.base.advice import ask
from workbench.base.progress import progress
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import clock_of
from workbench.diagnosis.claims.claimed_causes import odds_over_time, undecided
from workbench.diagnosis.claims.named_joints import clearness
from workbench.diagnosis.confidence import CERTAIN, PROBABLE
from workbench.diagnosis.coverage import loads_vary, too_few_rows
from workbench.diagnosis.drivers.driver import MIN_MIXED, Driver, driver_of
from workbench.diagnosis.drivers.evidence import DriverEvidence, evidence_of, is_nameless
from workbench.diagnosis.drivers.gravity import gravity_elsewhere
from workbench.diagnosis.drivers.path import path_of
from workbench.diagnosis.event_notes import without_undecided
from workbench.diagnosis.final_fit import fit_with_constants_held, geometry_as_identified
from workbench.diagnosis.search.evidence import NONZERO_ERRORS, Model, Term, drop
from workbench.diagnosis.search.reduced_models import left_of
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
from workbench.identification.errors.row_errors import Errors, Validation, explains_little
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared

LAST, MAX_WORSE = 0.25, 1.05
"""Share of the rows that are the last ones, and how much worse a law may make their error."""


@dataclass(frozen=True, eq=False)
class CauseSearch:
    """Result of the search.

    Args:
        robot: The nominal arm, with assumed masses where its file has none.
        ready: The rows, without held-out ones that may lie on either side of an event.
        first: The geometry alone.
        rounds: The searches, first to last.
        judged_fit: The last round's arm; as it is saved, if there are no held-out rows to be fitted to it.
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
    rounds: Sequence[Searched]
    judged_fit: Fit
    still: Dataset | None
    too_few: str | None
    nominal: Validation
    before: Validation
    after: Validation

    @property
    def last(self) -> Searched:
        """The last round, at the final fit to the fitted rows."""
        return self.rounds[-1]

    def errors(self, model: Model) -> Errors:
        """Of the geometry with a model's effects, by the linear solution at the fit, on the judging rows."""
        fit, held_out = self.last.stage.fit, self.ready.held_out_data
        data = held_out if len(held_out) else fit.problem.data
        arm = robot_with(fit, self.last.grams, model)
        return self.ready.errors_on(data, arm, fit.problem.instrument(fit.x))

    @cached_property
    def drivers(self) -> DriverEvidence | None:
        """What the error follows at the final fit; None if too few rows tell."""
        if self.too_few is not None:
            return None
        return ask("the drivers", lambda: DriverEvidence.of(self.last, self.ready.data), None)

    def _is_over(self, model: Model, term: Term) -> bool:
        """Whether the last rows are better without a law, which may have ceased; arms are saved for later."""
        fit, data = self.last.stage.fit, self.last.stage.problem.data
        clock = clock_of(data)[0]
        if term.candidate.effect.is_event or mixed_share(data.q, clock) <= MIN_MIXED:
            return False  # where postures come in an order, the last rows may differ by these alone
        late = data.take(np.flatnonzero(clock >= np.quantile(clock, 1.0 - LAST)))
        arms = (robot_with(fit, self.last.grams, m) for m in (model, drop(model, [term])))
        new, old = (self.ready.errors_on(late, arm, fit.problem.instrument(fit.x)).main.mean for arm in arms)
        return new > MAX_WORSE * old

    def lasting(self) -> Model:
        """The last model without what is of no use for other rows.

        The arm after a warm-up that any smooth function of the time explains as well is that function beyond
        its rows, which nobody knows. What has no name must predict the rows that judge it.
        """
        model, drivers = self.last.model, self.drivers
        if not model or drivers is None:
            return model
        warm = [t for t in model if isinstance(t.candidate.effect, WarmUp)]
        caps = [challenge.cap for challenge in drivers.challenges([(t,) for t in warm])]
        if lost := [t for t, cap in zip(warm, caps, strict=True) if cap <= 1.0]:
            return drop(model, lost)
        kept = drivers.lasting(undecided(drivers))
        if gone := [t for t in kept if self._is_over(kept, t)]:
            return drop(kept, gone)
        named = drop(kept, [*filter(is_nameless, kept)])
        is_better = len(kept) < len(model) or self.errors(named).main.mean > self.after.judged.main.mean
        return kept if is_better else named


def search_causes(robot: Robot, ready: Prepared, rng: np.random.Generator) -> CauseSearch:
    """Fit the geometry, then search for effects; a result that explains next to nothing means a wrong arm."""
    progress(0.3, "fitting the geometry, excluding outliers")
    first = geometry_first(ready.problem)
    too_few = too_few_rows(first.fit)
    tried = Tried.ALL if too_few is None else Tried.NONE
    if too_few is not None and loads_vary(first.fit.problem.data):
        tried, too_few = Tried.LOADS, None
    validated = partial(_validated_search, robot, ready, first, too_few)
    path = path_of(first.problem.data, ready.data)
    if too_few is None and path is not None and path.is_steady:
        alone = validated(rounds(first, rng, tried=Tried.NONE))
        if ask("a lag", lambda: alone.drivers is not None and alone.drivers.is_lag, False):
            return alone
    try:
        found = _rounds_with_sure_events(first, rng, tried)
    except np.linalg.LinAlgError:  # models beyond rounding, of rows that are far from any arm
        found = rounds(first, rng, tried=Tried.NONE)
    progress(0.8, "judging the result")
    search = validated(found)
    drivers = search.drivers
    if drivers is not None and (pull := ask("gravity", lambda: gravity_elsewhere(drivers), None)) is not None:
        turned = validated(_rounds_with_sure_events(under_gravity(first, pull), rng, tried))
        gain = description_length(search.last) - description_length(turned.last)
        search = turned if gain > np.log(CERTAIN) and _shows_gravity(turned) else search
    if explains_little(search.nominal.train, search.after.train, robot.reach):
        search = validated(rounds(first, rng, tried=Tried.NONE))
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


def _rounds_with_sure_events(first: Stage, rng: np.random.Generator, tried: Tried) -> tuple[Searched, ...]:
    """The search for events and effects, taken up again without uncertain events and drifts.

    Consecutive rows often have similar postures, so an event that is less than certain may be an effect of
    posture; and what follows the time by no law is no law for the time to come.
    """
    found, refused = rounds(first, rng, tried=tried), set[str]()
    while odds := odds_over_time(found[-1]):
        unsure = [candidate for candidate, its_odds in odds.items() if its_odds < PROBABLE]
        if not unsure:
            break
        events = [c for c in odds if c.effect.is_event and c not in unsure]
        refused |= {c.effect.name for c in unsure if not c.effect.is_event}
        rest = [t for t in found[-1].model if t.candidate not in unsure]
        found = rounds(refitted(found[-1], rest), rng, tried=tried, events=events, without=refused)
    return found


def _validated_search(
    robot: Robot, ready: Prepared, first: Stage, too_few: str | None, found: Sequence[Searched]
) -> CauseSearch:
    """A search, refitted until it is without what is of no use for other rows, with its errors on rows that
    lie on a known side of its events, and of all arms on the same rows: without outliers."""
    still: Dataset | None = None
    while True:
        last, rows = found[-1], without_undecided(ready, found[-1])
        is_own = len(rows.held_out_rows) and still is None
        fit = last.stage.fit if is_own else fit_with_constants_held(last, still)
        keep, geometry = last.stage.keep, first.fit
        if not last.model:
            geometry = fit = geometry_as_identified(fit, rows.problem.noise if keep.all() else None)
        fit = ready.scaled(fit)
        arms = ((f.arm, {**f.problem.known, **f.problem.instrument(f.x)}) for f in (geometry, fit))
        errors = (rows.nominal, *(rows.errors(*arm) for arm in arms))
        judged = (Validation(e.train.take(keep), e.held_out) for e in errors)
        search = CauseSearch(robot, rows, first, found, fit, still, too_few, *judged)
        if still is not None or (drivers := search.drivers) is None:
            return search
        kept = ask("what lasts", search.lasting, last.model)
        if len(kept) < len(last.model):
            found = (*found, reduced(last, kept))
        elif (still := ask("a frame at rest", partial(drivers.at_rest, ready.data), None)) is None:
            return search
