"""Preparation of every run on measured rows: choose and hold out rows, decide frames, estimate noise."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import final

import numpy as np
from jaxtyping import Float

from workbench.arm.mounting import Mounting
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.progress import progress
from workbench.base.wording import plural
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import beside, with_drivers
from workbench.data.plausibility import checked
from workbench.identification import noise as noises
from workbench.identification.algorithms.identifier import SearchOutcome
from workbench.identification.algorithms.ols import Ols
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import align, thinned
from workbench.identification.errors.expected_deviation import AUTO, MAX_DEVIATION, with_expected_deviation
from workbench.identification.errors.row_errors import (
    UNKNOWN,
    Errors,
    Validation,
    instrument_places,
    row_errors,
    together,
)
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import FitChoices, Sessions
from workbench.identification.frames import check_known_base, choose_frames, visible_parts
from workbench.identification.instrument_preparation import AbstractIdentifiability, preparation_of
from workbench.identification.joint_reading_noise import check_joint_noise
from workbench.identification.prior import Prior
from workbench.identification.problem import FrameFreedom, Noise, Problem
from workbench.identification.problem_blocks import observed_kinds, of_rows
from workbench.identification.rows import row_selection as selection

MIN_HELD_OUT_PER_PLACE = 6
"""Minimum number of held-out rows to locate an anchor and judge the arm: twice its three unknowns."""
UNKNOWN_NOISE = "noise unknown, neither stated nor from repeated poses"
UNLOCATED = "held out, with an anchor or contact that too few rows use"
"""Reason of held-out rows whose place can't be located."""
MAX_NOISE_FITS, MAX_NOISE_FITS_APART = 2, 5
"""Maximum number of fits to estimate the noise: alone, and beyond what rows state or of few rows."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Prepared(selection.AbstractSplit):
    """A problem ready to be solved, and the rows on which its solution is judged.

    Args:
        aligned: The nominal arm with the best base and tool wherever those are free.
        problem: The whitened fitting problem on the rows to fit.
        near: Solution of the fit that the noise was estimated from, where it was.
        new_sessions: Held-out sessions that no fitted row has; their base is found from their own rows.
        identifiability: What of the arm the rows may identify.
        scale: Length that is held in the problem, as no row tells the arm's scale; empty: none is.
    """

    data: Dataset
    aligned: Robot
    problem: Problem
    near: Float[np.ndarray, " p"] | None
    new_sessions: tuple[str, ...]
    identifiability: AbstractIdentifiability
    scale: str = ""

    def scaled(self, fit: Fit) -> Fit:
        """A fit, where no row tells the scale with all lengths as uncertain as they are expected to be.

        A search would shrink the arm to shrink its residuals: what it finds is only moved along the line on
        which no row changes, nearest to nominal.
        """
        problem = fit.problem
        if not self.scale or self.scale in problem.names:
            return fit
        free = [e.name for e in problem.robot.elements if e.name in {*problem.names, self.scale}]
        wide = problem.again(free=free).with_row_weights(problem.row_weights)
        x, is_held = wide.at(problem.named(fit.x)), np.array([name == self.scale for name in wide.names])
        wide = with_expected_deviation(wide, problem.deviation or AUTO, x=x)
        jacobian, line = wide.evaluate(x).jacobian, is_held.astype(float)
        line[~is_held] = -np.linalg.lstsq(jacobian[:, ~is_held], jacobian[:, is_held], rcond=1e-9)[0][:, 0]
        own = line[wide.geometry]
        x -= line * (own @ (x - wide.start)[wide.geometry]) / (own @ own)
        return replace(fit, problem=wide, search=replace(fit.search, x=x, factor=None))

    def errors(self, robot: Robot, instrument: Mapping[str, float]) -> Validation:
        """Errors of a model on the fitted and on the held-out rows.

        Args:
            instrument: Places of anchors, contacts or markers identified with it [m].
        """
        fitted, held = self.problem.data, self.held_out_data
        if both := together(fitted, held):
            used, parts = both
        elif fitted.readings is None and self.is_one_file:
            rows = np.sort(np.concatenate([self.train_rows, self.held_out_rows]))
            used = of_rows(self.data, rows)
            parts = [np.searchsorted(rows, mine) for mine in (self.train_rows, self.held_out_rows)]
        else:
            return Validation(*(self.errors_on(rows, robot, instrument) for rows in (fitted, held)))
        return Validation(*map(self.errors_on(used, robot, instrument).take, parts))

    def errors_on(self, data: Dataset, robot: Robot, instrument: Mapping[str, float]) -> Errors:
        """Errors of a model on some of the fitted or held-out rows; arguments as of `errors`."""
        if not len(data):
            return UNKNOWN
        arm, known = self.with_new_session_bases(robot, data), {**self.problem.known, **instrument}
        return row_errors(arm, data, known=known)

    @cached_property
    def shared(self) -> Problem:
        """The problem in which each posture counts once."""
        return self.problem.with_shares()

    @cached_property
    def first_fit(self) -> tuple[Problem, SearchOutcome]:
        """That problem, on some of the rows where there are many, and its solution with the widest prior."""
        some = thinned(self.shared)
        algorithm = Opt2(limit=60) if self.near is None else Ols()
        return some, algorithm.search(some.with_deviation(MAX_DEVIATION), begin=self.near)

    @cached_property
    def nominal(self) -> Validation:
        """Errors of the aligned nominal arm."""
        places = instrument_places(self.aligned, self.problem.data, known=self.problem.known)
        return self.errors(self.aligned, places)

    def with_new_session_bases(self, robot: Robot, data: Dataset) -> Robot:
        """The robot with bases for sessions that are not in the fit, estimated from their own rows."""
        new = [name for name in data.sessions if name in self.new_sessions]
        if not new:
            return robot
        data = data.take(np.isin(np.asarray(data.session), new))
        freedom = FrameFreedom(visible_parts(data)[0], base_per_session=True)
        own = align(replace(robot, sessions={}), data, freedom)
        return replace(robot, sessions={**robot.sessions, **own.sessions})

    def new_mountings(self, robot: Robot) -> dict[str, Mounting]:
        """Base and tool of an arm in held-out sessions that are not in the fit."""
        own = self.with_new_session_bases(robot, self.held_out_data).sessions
        return {name: own[name] for name in self.new_sessions if name in own}


def prepare(
    robot: Robot,
    data: Dataset,
    choices: FitChoices,
    *,
    prior: Prior | None = None,
    effects: Sequence[str] = (),
) -> Prepared:
    """All steps before the algorithms run; arguments as in `identify`."""
    check_joint_noise(choices.noise, robot.dof)
    progress(0.0, "checking the rows")
    complete = with_drivers(robot, checked(robot, data))
    _check_known_places(complete, choices)
    rows = _choose_rows(robot, complete, choices)
    free = tuple(dict.fromkeys(robot.default_free if choices.free is None else choices.free))
    if length := selection.scale_fixing_length(robot, rows.train_data, free, choices.known):
        free = tuple(name for name in free if name != length)
        rows = rows.noted("contacts don't determine scale: it is as near to nominal as all lengths allow")
    without_prior = [name for name in (*free, *effects) if prior is None or name not in prior.names]
    share = choices.held_out if isinstance(choices.held_out, float) else 0.0
    selection.check_enough(robot, rows.train_data, without_prior, held_out=share)
    if Sessions(choices.frames) is not Sessions.SHARED:
        selection.check_sessions(rows.train_data)
    own = preparation_of(rows.train_data)
    rows = selection.as_marked(rows, own.suited(robot, rows.train_data), "train")
    progress(0.25, "deciding whether base and tool are free")
    frames = choose_frames(robot, rows.train_data, choices, free=free, effects=tuple(effects), prior=prior)
    rows = rows.noted(*frames.notes)
    progress(0.5, "deciding what can be identified")
    tried, first = frames.first or (None, None)
    usual = partial(Problem.build, frames=frames.freedom, known=choices.known, effects=effects)
    build = usual if tried is None else lambda *_, **__: tried
    problem, identifiability = own.decide(frames.robot, rows.train_data, free=free, build=build)
    if not problem.names:
        wrong = "nothing is free to identify; free a constant of the arm, its base or its tool"
        raise OptionError(wrong, option="free")
    if prior is not None:
        shared = sum(name in problem.names for name in prior.names)
        rows = rows.noted(f"prior knowledge of {plural(shared, 'constant')} from an earlier calibration")
        problem = tried or prior.on(problem)
    progress(0.75, "estimating the noise")
    near: Float[np.ndarray, " p"] | None = None
    if not identifiability.is_limited:
        problem, decision, near = _with_noise(problem, choices.noise, first)
        rows = rows.noted(decision)
    rows = rows.noted(*identifiability.notes)
    if preparation_of(rows.held_out_data) is own:
        comparable = own.comparable(rows.held_out_data, problem.data)
        lost = [] if rows.is_one_file else selection.marked(comparable)
        more = [f"{plural(len(lost), 'held-out row')} ignored: {why}" for _, why in lost[:1]]
        rows = selection.as_marked(rows, comparable).noted(*more)
    rows = _exclude_unlocated(rows, {*choices.known, *problem.names})
    is_own = frames.freedom.base and Sessions(choices.frames) is not Sessions.SHARED
    new = tuple(n for n in rows.held_out_data.sessions if is_own and n not in rows.train_data.sessions)
    if new:
        how = "its base was fitted to its own rows, the arm to those of the other sessions"
        rows = rows.noted(f"held-out session {', '.join(new)}: {how}")
    ready = Prepared(
        **rows.split,
        data=complete,
        aligned=frames.robot,
        problem=problem,
        near=near,
        new_sessions=new,
        scale=length if prior is None and length else "",
        identifiability=identifiability,
    )
    check_known_base(robot, frames.freedom, rows.train_data, ready.nominal.train, choices)
    return ready


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class _Split(selection.AbstractSplit):
    """The chosen rows."""

    train_data: Dataset

    def noted(self, *notes: str) -> "_Split":
        return replace(self, notes=(*self.notes, *notes))


def _choose_rows(robot: Robot, data: Dataset, choices: FitChoices) -> _Split:
    """The chosen rows."""
    rows, excluded = selection.choose_rows(robot, data, choices.exclude, choices.region, choices.known)
    used, other = of_rows(data, rows), choices.held_out
    if lost := preparation_of(used).contradicted(robot, used):
        excluded = [*excluded, *((int(rows[i]), why) for i, why in lost.items())]
        rows = np.delete(rows, [*lost])
        used = of_rows(data, rows)
    there = np.isin(data.row, [*choices.exclude]) & np.isfinite(data.q).all(1)
    drawn = np.union1d(rows, np.flatnonzero(there))
    share = 0.0 if isinstance(other, Dataset) else other
    is_held = selection.hold_out(of_rows(data, drawn), np.isin(drawn, rows), share, choices.seed)
    train, held = np.flatnonzero(~is_held), np.flatnonzero(is_held)
    held_out_data, again = of_rows(used, held), list[str]()
    if isinstance(other, Dataset):
        other = with_drivers(robot, checked(robot, other))
        other = of_rows(other, selection.choose_rows(robot, other, {}, choices.region, None)[0])
        held_out_data, again = selection.without_fitted_rows(other, used)
        held_out_data = beside(held_out_data, used)
    warnings = robot.extrapolation_warnings(used.q, used.row)
    return _Split(
        train_data=of_rows(used, train),
        train_rows=rows[train],
        held_out_data=held_out_data,
        held_out_rows=rows[held],
        excluded=tuple(excluded),
        notes=(*data.notes, *selection.unused_observations(data), *warnings, *again),
    )


def _check_known_places(data: Dataset, choices: FitChoices) -> None:
    """Raise if a place is said to be known that no row uses."""
    used = [rows for rows in (data, choices.held_out) if isinstance(rows, Dataset)] if choices.known else ()
    places = {n for r in used for kind, own in observed_kinds(r) for n in kind.of(r.take(own)).unknowns}
    if stray := sorted(choices.known.keys() - places):
        known = f"choose from {', '.join(sorted(places))}" if places else "no row measures one"
        raise OptionError(f"known: '{stray[0]}' is no place that the rows use; {known}")


def _exclude_unlocated(rows: _Split, known: Collection[str]) -> _Split:
    """The rows without held-out ones whose anchors and contacts are neither known (coordinates such as
    "anchor[A].x") nor can be located from these rows."""
    data, notes = rows.held_out_data, list[str]()
    keep = selection.placed(data, known)
    if keep.all():
        return rows
    other = np.flatnonzero(~keep)
    columns = [np.asarray(c)[other].astype(str) for c in (data.anchor, data.contact) if c is not None]
    _, label, count = np.unique(np.array(columns), axis=1, return_inverse=True, return_counts=True)
    enough = count[label.ravel()] >= MIN_HELD_OUT_PER_PLACE
    keep[other[enough]] = True
    strange = "held-out rows use anchors or contacts that no fitted row uses"
    if enough.any():
        where = "they were located from these rows, the arm was fitted to the others"
        notes.append(f"{int(enough.sum())} {strange}: {where}")
    if not enough.all():
        notes.append(f"{int((~enough).sum())} {strange}, fewer than {MIN_HELD_OUT_PER_PLACE} each; ignored")
    lost = dict.fromkeys(np.flatnonzero(~keep).tolist(), UNLOCATED)
    return selection.as_marked(rows, data.kept_out(lost)).noted(*notes)


def _with_noise(
    problem: Problem, noise: Noise | None, first: SearchOutcome | None
) -> tuple[Problem, str, Float[np.ndarray, " p"] | None]:
    """The problem whitened by the noise as given, else of repeats, else of a fit's residuals; where that is
    from; and this fit, begun with the first search, if near the start. Of many rows some are enough."""
    stated = noises.share_stated(problem)
    on_top = ", plus that stated per row" if stated else ""
    known = noise or (None if stated else noises.from_repeats(problem.data))
    if known is not None:
        whence = "from repeated poses" if noise is None else "as given"
        text = f"noise {whence}: {_noise_text(problem, known)}{on_top}"
        problem = problem.with_noise(known)
        if problem.channels[2].any():  # that of additional inclinometers is estimated by a fit
            found = Opt2(limit=60).search(problem)
            left = noises.beyond_stated(problem, found.x, found.factor)
            problem = problem if left is None else problem.with_noise(known._replace(tilt=left.tilt))
        return problem, text, None
    whole, problem = problem, thinned(problem)
    found = first or Opt2(limit=60).search(problem)
    many = MAX_NOISE_FITS_APART if stated or noises.is_of_few(problem) else MAX_NOISE_FITS
    for k in range(many):
        found = Opt2(60).search(problem, begin=found.x) if k else found
        old, left = problem.noise, noises.beyond_stated(problem, found.x, found.factor)
        if left is None:
            text = _noise_text(problem, old)
            return whole, f"no residual is left to estimate the noise from; assuming {text}{on_top}", None
        problem = problem.with_noise(left)
        sizes = ((n.position, n.rotation, n.tilt) for n in (left, old))
        if all(abs(new - was) <= 0.2 * was for new, was in zip(*sizes, strict=True)):
            break
    near = found.x if np.abs(found.x - problem.start).max(initial=0.0) < MAX_DEVIATION else None
    noise, problem = problem.noise, whole.with_noise(problem.noise)
    text = _noise_text(problem, noise)
    if not stated:
        return problem, f"{UNKNOWN_NOISE}: the geometry leaves {text} per axis, of unknown origin", near
    nothing_more = (0.0, 0.0 if problem.sees_rotation else noise.rotation)
    if stated == 1.0 and noise[:2] == nothing_more:
        return problem, "noise as stated per row", near
    floor = noises.stated(problem)
    base = f" ({_noise_text(problem, floor)})" if floor is not None else ""
    text = f"noise as stated per row{base}, plus {text} of model error estimated from the residuals"
    return problem, text, near


def _noise_text(problem: Problem, noise: Noise) -> str:
    return (noise if problem.sees_rotation else noise._replace(rotation=np.nan)).text
