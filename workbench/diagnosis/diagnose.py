"""Diagnosis from end to end: a search for causes, the arm that is saved, what is claimed of it, advice."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Unpack

import numpy as np

import workbench.diagnosis.report.document  # noqa: F401 how results are shown
from workbench.arm.masses import with_assumed_masses
from workbench.arm.robot import Robot
from workbench.base.advice import ask, failures
from workbench.base.arguments import checked_arguments, with_fields
from workbench.base.errors import DataError
from workbench.base.progress import part_of, progress, whole_or_nothing
from workbench.base.threads import one_thread
from workbench.base.wording import first_of
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import with_directions
from workbench.diagnosis.cause_search import CauseSearch, search_causes
from workbench.diagnosis.claims.cause import Cause, ResidualMap, largest_first
from workbench.diagnosis.claims.claimed_causes import MAX_CAUSES, find_causes
from workbench.diagnosis.coverage import one_pose
from workbench.diagnosis.drivers.driver import Driver, Shape, driver_of
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.diagnosis.gravity_tilt import gravity_direction_causes
from workbench.diagnosis.mended_rows import MAX_MENDS, MendedRows, changes
from workbench.diagnosis.next_poses import Measurable, next_poses
from workbench.diagnosis.notes import notes
from workbench.diagnosis.payload import MISSTATED, misstated_payload, refuse_heavy, with_sign
from workbench.diagnosis.remaining_error import CHANGED, LAGGED, RemainingError
from workbench.diagnosis.result import Diagnosis, harm_done
from workbench.diagnosis.saved_model import SavedModel, best_geometry, saved_model
from workbench.diagnosis.search.evidence import is_nameless
from workbench.diagnosis.verdict import conclude
from workbench.identification import noise as noises
from workbench.identification.checks.common_errors import two_kinds, worse_by_column
from workbench.identification.errors.row_errors import UNKNOWN
from workbench.identification.fit_choices import ChoiceFields, FitChoices, choices_as_read
from workbench.identification.instrument_preparation import preparation_of
from workbench.identification.joint_reading_noise import readings
from workbench.identification.meaning.as_read import as_read
from workbench.identification.problem import Noise
from workbench.identification.rows.excluded_outliers import GROSS, MAX_NAMED_ROWS, prepare_without_outliers
from workbench.identification.run import Run

NO_WAY = "the first row, of which no row before it tells by which way it came"
"""Why a row that an effect of motion can't predict is left out."""


@checked_arguments(FitChoices)
@whole_or_nothing()
@one_thread()
def diagnose(
    robot: RobotLike,
    data: DatasetLike,
    choices: FitChoices | None = None,
    *,
    measurable: Measurable | None = None,
    **fields: Unpack[ChoiceFields],
) -> Diagnosis:
    """Find the effects that the model of an arm lacks, add them, and validate them on held-out rows.

    Args:
        robot: Nominal arm; effects that it already has keep their values.
        data: Measurements, with any drivers of effects.
        choices: Rows and frames of the fit; its fields may be given as keywords, such as `held_out=0.2`,
            where `choices` does not set them.
        measurable: Whether a posture can be measured next; all reachable ones if None.

    Raises:
        DataError: too few rows, data that contradict the robot beyond doubt, or readings that can't be
            diagnosed, such as pictures.
        OptionError: an unknown constant or option.
        Cancelled: it was cancelled; what was found by then is no conclusion.
    """
    if why := preparation_of(data).undiagnosed:
        raise DataError(f"{data.source}: {why}")
    began, choices = perf_counter(), with_fields(FitChoices, choices, fields)
    robot, data, _ = as_read(robot, data, choices.reading, exclude=choices.exclude)
    choices = choices_as_read(robot, choices)
    massed, rng = with_assumed_masses(robot), np.random.default_rng(choices.seed)
    refuse_heavy(massed, data)
    if is_other := isinstance(held := choices.held_out, Dataset):
        choices = replace(choices, held_out=with_directions(held))
    with failures() as failed:
        searched = partial(_searched, massed, rng=rng, given=robot)
        search, saved, found = searched(data, choices)
        if (poses := one_pose(search.first.fit, data)) is not None:
            data = poses
            search, saved, found = searched(data, choices)
        result, most = found, search.after.train.main.mean
        mended = None if is_other else MendedRows(data, data)
        for _ in range(MAX_MENDS):
            mended = mended and ask("rows of one arm", partial(mended.again, found), None)
            if mended is None:
                break
            fewer = replace(choices, exclude={**choices.exclude, **mended.left_out})
            again = ask("the arm by such rows", partial(searched, mended.mended, fewer), None)
            if again is None or again[0].too_few is not None or again[0].after.train.main.mean >= most:
                break
            (search, saved, found), most = again, again[0].after.train.main.mean
            result = mended.told(found)
        progress(0.9, "choosing poses to measure next")
        fit, laws = search.last.stage.fit, [c for c in result.causes if c.is_law]
        refused = {e.names for c in result.causes if not c.is_law for e in c.effects}
        wanted = [a.effect for a in saved.effects if a.effect.names not in refused]
        wanted += [e for c in laws for e in c.look_alikes]  # which these poses are to separate
        chosen = partial(next_poses, fit.problem, fit.x, wanted, rng=rng, measurable=measurable)
        following = ask("poses to measure next", chosen, (np.zeros((0, robot.dof)), ()))
    progress(1.0, "done")
    result = replace(result, measure_next=following[0], next_reasons=following[1])
    return replace(result, warnings=tuple(failed), seconds=perf_counter() - began)


def _searched(
    massed: Robot, data: Dataset, choices: FitChoices, *, rng: np.random.Generator, given: Robot
) -> tuple[CauseSearch, SavedModel, Diagnosis]:
    """A search in some rows, what is saved of it, and the result but for poses to measure next."""
    with part_of(0.0, 0.3):
        ready, gross = prepare_without_outliers(massed, with_directions(data), choices, reasons=[GROSS])
    saved = saved_model(search := search_causes(massed, ready, rng))
    return search, saved, _diagnosis(search, saved, given=given, known=choices.noise, gross=gross)


def _remaining_error(search: CauseSearch, known: Noise | None) -> RemainingError:
    """Noise and drivers of the residuals; noise stated in the rows comes before `known`, then repeats. What a
    payload that isn't the file's leaves is told once it is right."""
    stage, ready, fit = search.last.stage, search.ready, search.last.stage.fit
    rows = ready.data.take(np.union1d(ready.train_rows, ready.held_out_rows))
    loose = worse_by_column(search.first.fit, rows, {})
    followed, drivers = tuple[FollowedDriver, ...](), search.drivers
    if drivers is not None and not loose:
        followed = ask("the payload", lambda: misstated_payload(drivers, ready.data), ())
        followed = followed or ask("what the rest follows", lambda: drivers.rest, ())
    noise = noises.beyond_stated(fit.problem, fit.x, fit.factor, in_all=True) or stage.geometric_problem.noise
    return RemainingError(
        noise=noise if fit.problem.sees_rotation else noise._replace(rotation=np.nan),
        known_noise=noises.stated(ready.problem) or known or noises.from_repeats(ready.problem.data),
        joint_noise=ask("the noise of joint readings", lambda: readings(stage.weighed), None),
        followed=followed,
        places=loose or ("" if followed else two_kinds(fit, rows)),
        is_loose=bool(loose),
    )


def _followed(
    search: CauseSearch, causes: Sequence[Cause], remaining: RemainingError
) -> tuple[tuple[FollowedDriver, ...], str]:
    """Drivers that the error follows beside causes that have a law, and what a correction would reduce."""
    if (drivers := search.drivers) is None or remaining.is_loose:
        return (), ""
    laws = {e.names for c in causes if c.is_law for e in c.effects}
    sure = tuple(t for t in search.last.model if t.candidate.names in laws)
    rest, found = remaining.followed, tuple(remaining.followed)
    if any(f.shape in (Shape.CARRIED, Shape.HANGS) for f in found):
        return found, ""
    if sure != search.last.model:
        found = ask("what the error follows", lambda: drivers.followed(sure), ())
    named = [t.candidate.effect for r in search.passes for t in r.model if not is_nameless(t)]
    others, chain = [e for e in named if e.names not in laws], search.last.stage.fit.arm.chain

    def kinds(follows: FollowedDriver) -> tuple[str, ...]:
        mine = (e for e in others if driver_of(e) == follows.driver)
        held = (e for e in others if any(p.holds(e, chain) for p in (*follows.parts, *follows.either)))
        return tuple(dict.fromkeys(e.name for e in (held if follows.either else mine)))

    found = tuple(replace(with_sign(f, drivers, sure), laws=kinds(f)) for f in found)
    return found, ask(
        "a correction", lambda: drivers.correction(rest, search.after.judged) if rest else "", ""
    )


def _residual_map(search: CauseSearch, saved: SavedModel, causes: Sequence[Cause]) -> ResidualMap | None:
    """The accepted effects that are not causes, with their contribution beside the causes."""
    claimed = {e.names for c in causes for e in c.effects}
    others = tuple(a.effect for a in saved.effects if a.effect.names not in claimed)
    if not others:
        return None
    named = tuple(t for t in search.last.model if t.candidate.names in claimed)
    alone = search.before.judged
    with_causes = ask("the error with causes alone", lambda: search.errors(named), alone) if named else alone
    is_better = with_causes.main.mean < alone.main.mean
    before, after = with_causes if is_better else alone, search.after.judged
    return ResidualMap(effects=others, before=before, after=after, beside_causes=is_better)


def _additions(search: CauseSearch, saved: SavedModel, harm: str | None) -> Iterator[str]:
    """Sentences that follow the verdict: harm, rows that no arm explains, which arm is saved."""
    if harm:
        yield f"Warning: {harm}."
    others = search.after.without(saved.suspects).text("mean")
    if others and saved.suspects.any() and not saved.suspects.all():
        rows = first_of(search.ready.held_out_data.row[saved.suspects].tolist(), MAX_NAMED_ROWS)
        misses = "The arm with these effects misses" if search.last.model else "No arm explains"
        yield f"{misses} held-out rows {rows}; the error of the others is {others}."
    if saved.now:
        yield saved.now.sentence


def _diagnosis(
    search: CauseSearch, saved: SavedModel, *, given: Robot, known: Noise | None, gross: np.ndarray
) -> Diagnosis:
    """Causes, drivers without a law, residual map, what remains beside the noise known, verdict and arms; all
    but poses to measure next. `gross` are rows excluded before any fit."""
    ready, stage, fit, drivers = search.ready, search.last.stage, search.judged_fit, search.drivers
    remaining, causes = _remaining_error(search, known), tuple[Cause, ...]()
    if drivers is not None and saved.effects:
        causes = find_causes(search.last, saved.fit.arm, remaining.known_noise, saved.std, drivers)
    followed, correction = _followed(search, causes, remaining)
    tilted = gravity_direction_causes(saved.fit, given, remaining.noise, causes)
    doubts = [f"it is sized by {MISSTATED}" for f in followed if f.shape is Shape.CARRIED]
    doubt = max((t.doubt for t in tilted), default="") or next(iter(doubts), "")
    causes = tuple(c.doubted(doubt) if c.driver is Driver.LOAD else c for c in causes)
    found = enumerate(largest_first(*causes, *tilted))  # an event says in which state the arm is
    causes = tuple(c for k, c in found if k < MAX_CAUSES or c.event is not None)
    residual_map = _residual_map(search, saved, causes)
    verdict, message = conclude(search, saved, causes, followed, correction, residual_map, remaining)
    before, after = search.before.held_out, search.after.held_out
    harm = harm_done(before, after, remaining.noise) if saved.effects else None
    if drivers is not None and ask("a lag", lambda: drivers.is_lag, False):
        harm = LAGGED
    elif correction and changes(followed):
        harm = CHANGED
    message = " ".join(filter(None, (message, *_additions(search, saved, harm))))
    outliers = np.union1d(gross, ready.train_rows[~stage.keep]).astype(np.int64)
    first = np.zeros(len(outliers), bool)
    if ready.data.direction is not None and any("direction" in e.needs for e in fit.arm.effects):
        first = np.asarray(~ready.data.direction[outliers].any(1))
    begun, outliers = outliers[first].tolist(), outliers[~first]
    weighings = search.first.fit.problem.noise, ready.problem.noise
    geometries = {each: best_geometry(each, weighings) for each in {fit, saved.fit}}
    texts = {c.effects[0].names: c.text for c in causes if len(c.effects) == 1}
    split = ready.split | {
        "excluded": (*(e for e in ready.excluded if e[1] != GROSS), *((k, NO_WAY) for k in begun)),
        "notes": tuple(filter(None, notes(search, saved, outliers, given))),
    }
    return Diagnosis(
        **split,
        causes=causes,
        residual_map=residual_map,
        followed=followed,
        remaining=remaining,
        harm=harm,
        verdict=verdict,
        message=message,
        nominal_robot=search.robot,
        data=ready.data,
        outliers=outliers,
        outlier_errors=ask(
            "the errors of outliers",
            lambda: ready.errors_on(ready.data.take(outliers), fit.arm, fit.problem.instrument(fit.x)),
            UNKNOWN,
        ),
        suspects=np.flatnonzero(saved.suspects),
        nominal=search.nominal,
        before_fit=search.first.fit if search.last.model else fit,
        after_fit=fit,
        aligned=ready.aligned,
        before=search.before,
        after=Run(
            search.after.train,
            search.after.held_out,
            saved.fit,
            ready.held_out_data,
            before_refit=fit.calibrated.recorded(geometry=geometries[fit]) if saved.fit is not fit else None,
            geometry=geometries[saved.fit],
            new_sessions=ready.new_mountings(fit.calibrated),
        ),
        effects=tuple(replace(a, text=texts.get(a.effect.names, a.text)) for a in saved.effects),
        now=saved.now,
        is_tried=search.too_few is None,
        measure_next=np.zeros((0, given.dof)),
    )
