"""The rounds of a diagnosis: fit, exclude outliers, reweight, search for effects, fit again.

A stage is the state after a fit. Rounds end when a search finds the fitted model, or one found before: then
the fit with the shortest description length is kept.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Bool, Int

from workbench.arm.effects import AbstractEffect, Candidate
from workbench.arm.effects.events import AbstractEvent
from workbench.arm.motion import Motion
from workbench.base.progress import cancelled, progress
from workbench.base.types import Vector3
from workbench.data.dataset import Dataset
from workbench.data.postures import pose_units
from workbench.diagnosis.gravity_tilt import WIDE_SIGMA, freed
from workbench.diagnosis.search.backlash_flanks import holding_likeliest
from workbench.diagnosis.search.candidates import Catalogue, catalogue
from workbench.diagnosis.search.event_search import Changeable, Timeline, changeable, crowded, promising
from workbench.diagnosis.search.evidence import Model, Term, drop, rescaled, validated
from workbench.diagnosis.search.gram_matrices import Grams, compress
from workbench.diagnosis.search.refit import large, linear_answer, refit, with_own_noise
from workbench.diagnosis.search.stepwise_search import MAX_EARLY_EXCHANGE_EFFECTS, MIN_FALL
from workbench.diagnosis.search.stepwise_search import search as search_effects
from workbench.identification.errors.expected_deviation import MAX_DEVIATION
from workbench.identification.fit import Fit
from workbench.identification.problem import Problem
from workbench.identification.rows.excluded_outliers import MANY
from workbench.identification.rows.outlying_rows import robust_fit, row_sizes, standing_out

MAX_ROUNDS = 5
"""Maximum number of searches for effects …"""
MAX_LARGE_ROUNDS = 2
"""… and for large problems."""
MAX_OUTLIER_ROUNDS, MAX_WEIGHINGS = 3, 3
"""Maximum number of outlier rounds after one fit, and of its weighings by what it leaves: rows weighed by the
scatter of joints leave such scatter."""
EVENT_WINDOW, MIN_WINDOW_OUTLIERS = 7, 3
"""Window of consecutive rows, and number of outliers within it that may indicate an event."""
DIVERGED_RATIO = 1.5
"""Noise of a fit, relative to the one before it, above which it has diverged: the search ends at that
one, or goes on without events from the geometry alone."""
FOLDS = 5
"""Number of folds for cross-validation."""
MAX_EVENT_ROUNDS = 4
"""Maximum number of searches at one fit, each with the best event times given the last one's result."""
Tried = Callable[[AbstractEffect], bool]


@dataclass(frozen=True, eq=False)
class Stage:
    """State after a fit.

    Args:
        data: All rows to fit, outliers among them.
        keep: Which of them were fitted.
        geometric_problem: The problem of the geometry on the fitted rows, weighed by what the fit leaves.
        model: The accepted effects.
        fit: Geometry and their coefficients.
        spared: Outliers close to each other in time, or many: an event or play may explain them, so they are
            not excluded before these were searched.
    """

    data: Dataset
    keep: Bool[np.ndarray, " rows"]
    geometric_problem: Problem
    model: Model
    fit: Fit
    spared: Bool[np.ndarray, " rows"]

    @property
    def problem(self) -> Problem:
        """Geometry and accepted effects on the fitted rows."""
        return self.fit.problem

    @property
    def weighed(self) -> Problem:
        """The same, weighed by what the fit leaves."""
        return self.problem.with_noise(self.geometric_problem.noise)

    @property
    def motion(self) -> Motion:
        """Motion of the fitted rows."""
        return Motion.of(self.problem.data)


@dataclass(frozen=True, eq=False)
class Searched:
    """A search at a stage.

    Args:
        stage: Where it was made.
        offered: The candidates.
        grams: The inner products at the stage.
        model: The effects found.
        fold: Fold of every row of the stage, for cross-validation.
    """

    stage: Stage
    offered: Catalogue
    grams: Grams
    model: Model
    fold: Int[np.ndarray, " rows"]


def geometry_first(problem: Problem) -> Stage:
    """The geometry alone, with outliers excluded from all rows to fit."""
    data = problem.data
    fit = refit(problem, None, ())
    wide = fit.problem.with_deviation(MAX_DEVIATION)  # the expected one is of all rows
    out = standing_out(wide, robust_fit(wide, fit.x)[1])
    spared = out  # many may be one side of a play
    if out.mean() <= MANY:
        spared = crowded(out, data, within=EVENT_WINDOW, fewest=MIN_WINDOW_OUTLIERS)
    stage = Stage(data, ~out | spared, problem, (), fit, spared)
    return _without_outliers(_fit(stage, None, ()), None)


def under_gravity(stage: Stage, gravity: Vector3) -> Stage:
    """The geometry alone under another gravity in the axes of the base, whose direction is open."""
    problem = stage.geometric_problem
    mounting = replace(problem.robot.mounting, gravity_tolerance=WIDE_SIGMA)
    robot = replace(problem.robot, mounting=mounting).under(gravity)
    return _fit(replace(stage, geometric_problem=replace(problem, robot=robot)), None, ())


def rounds(
    stage: Stage, rng: np.random.Generator, *, tried: Tried | None, events: Sequence[Candidate] | None = None
) -> Searched:
    """The search at the fit where nothing new is found.

    Args:
        stage: The geometry, alone or with some effects.
        tried: Which effects are tried; None if rows suffice for none, nor for events.
        events: Possible events; searched if None.
    """
    fold = folds_of(stage.data, rng)
    done, is_last = list[Searched](), False
    while not is_last:
        number = len(done)
        progress(0.8 - 0.5 / (1 + number), f"round {number + 1}: trying every effect on every joint")
        last = _search(stage, fold, tried, events)
        if stage.spared.any():
            spared, stage = stage.spared, replace(stage, spared=np.zeros(len(stage.data), bool))
            if not any(t.candidate.effect.is_event or t.candidate.effect.has_play for t in last.model):
                stage = _without_outliers(_fit(replace(stage, keep=stage.keep & ~spared), None, ()), None)
                last = _search(stage, fold, tried, events)
        same = _same(last.model, stage.model)
        again = not same and any(_same(last.model, each.model) for each in done)
        done.append(last)
        over = len(done) == (MAX_LARGE_ROUNDS if large(stage.problem) else MAX_ROUNDS) or cancelled()
        is_last = same or again or over or not _better(last)
        if not is_last:
            progress(0.8 - 0.5 / (1.5 + number), f"round {number + 1}: fitting what was found")
            new = _without_outliers(_fit(stage, last.grams, last.model), last.grams)
            noises = (np.array(each.geometric_problem.typical_noise[:2]) for each in (new, stage))
            if not np.nanmax(np.divide(*noises)) > DIVERGED_RATIO:
                stage = new
            elif not number and any(t.candidate.effect.is_event for t in last.model):
                events = ()
            else:
                is_last = True
    best = min(done, key=description_length) if again else last
    fitted = _among(best.stage.model, best.offered.candidates)
    return replace(best, model=fitted)


def refitted(searched: Searched, kept: Sequence[Term]) -> Stage:
    """The stage of a search with some of its terms alone, its outliers and weights anew."""
    return _without_outliers(_fit(searched.stage, searched.grams, tuple(kept)), searched.grams)


def reduced(searched: Searched, kept: Model) -> Searched:
    """The search with some of its terms alone, refitted."""
    stage = _fit(searched.stage, searched.grams, kept)
    offered = searched.offered.candidates
    grams = compressed_at(stage, [c.effect for c in offered], searched.fold)
    return replace(searched, stage=stage, grams=grams, model=_among(kept, offered))


def compressed_at(
    stage: Stage,
    effects: Sequence[AbstractEffect],
    fold: np.ndarray,
    kinds: Sequence[Changeable] = (),
    line: Timeline | None = None,
) -> Grams:
    """Inner products at a stage's fit, with the history for events if requested."""
    changed, pieces = [k.event for k in kinds], None if line is None else line.piece
    return compress(stage.weighed, stage.fit.x, effects, fold[stage.keep], changed=changed, pieces=pieces)


def _better(searched: Searched) -> bool:
    """Whether a result has a shorter description than the fitted model, or predicts other folds noticeably
    better."""
    if _coefficients(searched.model) < _coefficients(searched.stage.model):
        return True
    fitted = _among(searched.stage.model, searched.offered.candidates)
    before, after = (validated(searched.grams, m).sum() for m in (fitted, searched.model))
    return bool(abs(before - after) > MIN_FALL * before)


def description_length(searched: Searched) -> float:
    """Description length of the rows by a stage's fit: residual noise, and ½ log N per coefficient."""
    problem = searched.stage.geometric_problem
    noise = problem.sigma[problem.inverse_sigma > 0.0]
    charge = 0.5 * _coefficients(searched.stage.model) * np.log(problem.count)
    return problem.count * float(np.log(noise).mean()) + charge


def _coefficients(model: Model) -> int:
    return sum(len(t.candidate.names) for t in model)


def folds_of(data: Dataset, rng: np.random.Generator) -> Int[np.ndarray, " rows"]:
    """Fold of every row, whole postures and groups together; by posture if all belong to one group."""
    groups = pose_units(data)
    if groups.max(initial=0) == 0:
        groups = pose_units(replace(data, group=None))
    count = min(FOLDS, int(groups.max()) + 1)
    order = rng.permutation(int(groups.max()) + 1)
    return (np.argsort(order) % count)[groups]


def _search(
    stage: Stage, fold: np.ndarray, tried: Tried | None, events: Sequence[Candidate] | None
) -> Searched:
    """Search for effects and for events at their best times, until no time improves."""
    if tried is None:
        alone = compress(stage.problem, stage.fit.x, [], fold[stage.keep])
        return Searched(stage, Catalogue((), ()), alone, (), fold)
    offered = catalogue(stage.geometric_problem.robot, Motion.of(stage.data))
    offered = replace(offered, candidates=tuple(c for c in offered.candidates if tried(c.effect)))
    kinds = changeable(stage.problem) if events is None else ()
    known = [t.candidate for t in stage.model if t.candidate.effect.is_event]
    moments = [c.effect.moment for c in known if isinstance(c.effect, AbstractEvent)]
    line = Timeline.of(stage.problem.data, moments)
    plain, happened = offered.candidates, [*(known if events is None else events)]
    compressed = partial(compressed_at, stage, fold=fold, kinds=kinds, line=line)
    grams = compressed([c.effect for c in (*plain, *happened)])
    model = _among(stage.model, (*plain, *happened))
    for number in range(MAX_EVENT_ROUNDS):
        rests = [model, *(drop(model, [t]) for t in model if len(model) <= MAX_EARLY_EXCHANGE_EFFECTS)]
        best = {c.names: c for rest in rests for c in promising(grams, rest, line, kinds)}
        new = [c for names, c in best.items() if names not in {h.names for h in happened}]
        if number and not new:
            break
        if new:
            happened += new
            grams = compressed([c.effect for c in (*plain, *happened)])
        model = search_effects(grams, (*plain, *happened), model)
    return Searched(stage, replace(offered, candidates=(*plain, *happened)), grams, model, fold)


def _fit(stage: Stage, grams: Grams | None, model: Model) -> Stage:
    """The stage with another model, or other rows, fitted from the last fit's linear prediction."""
    starts, data = [stage.problem.named(stage.fit.x)], stage.data.take(stage.keep)
    if grams is not None and not _same(model, stage.model):
        starts.append(linear_answer(stage.fit, grams, model))
    fit = refit(stage.geometric_problem, grams, model, data=data, starts=starts)
    geometric = freed(stage.geometric_problem, fit)
    if geometric is not stage.geometric_problem:
        fit = refit(geometric, grams, model, data=data, starts=[fit.problem.named(fit.x)])
    return replace(stage, geometric_problem=geometric, model=model, fit=fit)


def _without_outliers(stage: Stage, grams: Grams | None) -> Stage:
    """Exclude outliers until the selection no longer changes, then weight by the fit's residuals."""
    for _ in range(1 if large(stage.problem) else MAX_OUTLIER_ROUNDS):
        whole = stage.problem
        if not stage.keep.all():
            whole = whole.again(data=stage.data, noise=stage.geometric_problem.noise)
            whole = holding_likeliest(whole, stage.fit.x)
        sizes = row_sizes(whole, stage.fit.x, stage.keep, stage.fit.factor.root)
        keep = ~standing_out(whole, sizes) | stage.spared
        if any("direction" in e.needs for e in stage.problem.robot.effects):
            keep &= np.any(stage.data.direction != 0.0, axis=1)  # of a first row it is unknown
        if (keep == stage.keep).all():
            break
        stage = _fit(replace(stage, keep=keep), grams, stage.model)
    for _ in range(MAX_WEIGHINGS):
        before = stage.geometric_problem
        stage = replace(stage, geometric_problem=with_own_noise(stage.fit, before))
        if large(stage.problem):
            return stage
        after = stage.geometric_problem
        ratio = (np.array(before.typical_noise[:2]) / np.array(after.typical_noise[:2])) ** 2
        seen = float(ratio[np.isfinite(ratio)][0])  # of positions, or of orientations without these
        stage = _fit(stage, grams, rescaled(stage.model, seen))
        was, now = (np.sign(p.noise.joints) for p in (before, after))
        if np.array_equal(was, now) or not (stage.model and any(before.noise.joints)):
            break  # else joints may have seemed to scatter by what the model lacked before
    return stage


def _key(candidate: Candidate) -> str:
    """Key that identifies candidates across rounds."""
    shape = ""
    if candidate.covariance is not None:
        shape = " ".join(f"{c:.8g}" for c in candidate.covariance[[0, -1], [1, -1]].tolist())
    return f"{candidate.effect.name} {candidate.names} {shape}"


def _same(a: Model, b: Model) -> bool:
    return {_key(t.candidate) for t in a} == {_key(t.candidate) for t in b}


def _among(model: Model, candidates: tuple[Candidate, ...]) -> Model:
    """A model's terms as candidates of another round, as far as these are available."""
    offered, known = {_key(c): c for c in candidates}, {n for c in candidates for n in c.names}
    kept = (
        t
        for t in model
        if _key(t.candidate) in offered or (t.candidate.alike and known.issuperset(t.candidate.names))
    )
    return tuple(replace(t, candidate=offered.get(_key(t.candidate), t.candidate)) for t in kept)
