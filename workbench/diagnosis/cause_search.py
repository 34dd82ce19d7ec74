"""The search of a diagnosis: geometry alone, then rounds of events and effects until the result is confirmed.

Results are judged on rows that took no part in the search. It is repeated without uncertain events, under
another gravity if only that makes loads explain the error, and without anything if nothing explains much, or
if the joints' speed explains most: then joints and places are of different times.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Bool

from workbench.arm.robot import Robot
from workbench.base.advice import ask
from workbench.base.progress import progress
from workbench.diagnosis.claims.claimed_causes import odds_over_time, undecided
from workbench.diagnosis.confidence import CERTAIN, PROBABLE
from workbench.diagnosis.coverage import loads_vary, too_few_rows
from workbench.diagnosis.drivers.driver import Driver, driver_of, path_of
from workbench.diagnosis.drivers.evidence import DriverEvidence, is_nameless
from workbench.diagnosis.drivers.gravity import gravity_elsewhere
from workbench.diagnosis.event_notes import without_undecided
from workbench.diagnosis.final_fit import fit_with_constants_held, geometry_as_identified
from workbench.diagnosis.search.evidence import NONZERO_ERRORS, drop
from workbench.diagnosis.search.rounds import (
    Searched,
    Stage,
    Tried,
    description_length,
    geometry_first,
    reduced,
    rounds,
    under_gravity,
)
from workbench.identification.errors.row_errors import Validation, explains_little
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared


@dataclass(frozen=True, eq=False)
class CauseSearch:
    """Result of the search.

    Args:
        robot: The nominal arm, with assumed masses where its file has none.
        ready: The rows, without held-out ones that may lie on either side of an event.
        first: The geometry alone.
        rounds: The searches, first to last.
        judged_fit: The last round's arm; as it is saved, if there are no held-out rows to be fitted to it.
        too_few: Why no search was made; None if one was.
        before: Errors of the geometry on the fitted rows that are no outliers, and on the held-out rows.
        after: Errors of that arm on the same rows.
        nominal: Errors of the nominal arm, with the best base and tool, on the same rows.
    """

    robot: Robot
    ready: Prepared
    first: Stage
    rounds: Sequence[Searched]
    judged_fit: Fit
    too_few: str | None
    before: Validation
    after: Validation
    nominal: Validation

    @property
    def last(self) -> Searched:
        """The last round, at the final fit to the fitted rows."""
        return self.rounds[-1]

    @cached_property
    def drivers(self) -> DriverEvidence | None:
        """What the error follows at the final fit; None if too few rows tell."""
        if self.too_few is not None:
            return None
        return ask("the drivers", lambda: DriverEvidence.of(self.last, self.ready.data), None)


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
    """Whether a law of load is clear: gravity is seen through it alone."""
    if search.drivers is None:
        return False
    fit, open_ones = search.last.stage.fit, undecided(search.drivers)
    laws = (t.candidate for t in drop(search.last.model, open_ones) if not is_nameless(t))
    loaded = {n for c in laws if driver_of(c.effect) is Driver.LOAD for n in c.names}
    sizes = zip(fit.problem.names, np.abs(fit.x), fit.std, strict=True)
    return any(size >= NONZERO_ERRORS * error for name, size, error in sizes if name in loaded)


def _rounds_with_sure_events(first: Stage, rng: np.random.Generator, tried: Tried) -> tuple[Searched, ...]:
    """The search for events and effects, repeated without uncertain events and drifts.

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
        found = rounds(first, rng, tried=tried, events=events, without=refused)
    return found


def _validated_search(
    robot: Robot, ready: Prepared, first: Stage, too_few: str | None, found: Sequence[Searched]
) -> CauseSearch:
    """A search, refitted without what is of no use for other rows, with its errors on rows that lie on a
    known side of its events."""
    whole, ready = ready, without_undecided(ready, found[-1])
    fit = found[-1].stage.fit if len(ready.held_out_rows) else fit_with_constants_held(found[-1])
    keep, geometry = found[-1].stage.keep, first.fit
    if not found[-1].model:
        geometry = fit = geometry_as_identified(fit, ready.problem.noise if keep.all() else None)
    before, after = (
        _judged(ready.errors(f.arm, {**f.problem.known, **f.problem.instrument(f.x)}), keep)
        for f in (geometry, fit)
    )
    nominal, model = _judged(ready.nominal, keep), found[-1].model
    search = CauseSearch(robot, ready, first, found, fit, too_few, before, after, nominal)
    drivers = search.drivers if model else None
    kept = model if drivers is None else ask("what lasts", lambda: drivers.lasting(undecided(drivers)), model)
    if len(kept) == len(model):
        return search
    return _validated_search(robot, whole, first, too_few, (*found, reduced(found[-1], kept)))


def _judged(errors: Validation, keep: Bool[np.ndarray, " rows"]) -> Validation:
    """The same without outliers, so that all arms are compared on the same rows."""
    return Validation(errors.train_rows.take(keep), errors.held_out_rows)
