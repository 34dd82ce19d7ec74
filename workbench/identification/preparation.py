"""Preparation of every run on measured rows: choose and hold out rows, decide frames, estimate noise."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.errors import DataError, OptionError
from workbench.base.progress import Cancel, Report
from workbench.base.wording import plural
from workbench.data.camera.resection import with_boards, with_boards_in_view
from workbench.data.dataset import Dataset
from workbench.data.directions import with_drivers
from workbench.data.misread import checked
from workbench.identification import noise as noises
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.alignment import align
from workbench.identification.camera_checks import mismatched_pictures
from workbench.identification.camera_model_selection import Seek, select_camera_step
from workbench.identification.camera_selection_steps import Gate
from workbench.identification.fit_choices import FitChoices
from workbench.identification.frames import FrameChoice, Sessions, choose_frames, visible_parts
from workbench.identification.held_out_rows import (
    check_enough,
    choose_rows,
    divide,
    placed,
    scale_fixing_length,
    unused_observations,
)
from workbench.identification.prior import Prior
from workbench.identification.problem import FrameFreedom, Noise, Problem
from workbench.identification.row_errors import RowErrors, instrument_places, row_errors
from workbench.plate.region import Region

ENOUGH = 6
"""Held-out rows of an anchor or contact that show its place and the arm's error: twice its three unknowns."""

FEWEST_PICTURES = 4
"""Pictures below which camera and target are not found."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Prepared:
    """A problem that is ready to be searched, and the rows on which its answer is judged.

    Args:
        train_rows: Rows to fit, indices into data.
        held_out_rows: Rows that were held out of them.
        held: The held-out rows, which may come from another file.
        excluded: Rows that are kept out altogether, with the reason.
        aligned: The nominal arm with the best base and tool wherever those are free.
        problem: Of the rows to fit, whitened.
        new_sessions: Held-out sessions that no fitted row has; their base is found from their own rows.
        gate: What of the arm pictures may identify; None for other instruments.
    """

    data: Dataset
    train_rows: np.ndarray
    held_out_rows: np.ndarray
    held: Dataset
    excluded: tuple[tuple[int, str], ...]
    aligned: Robot
    problem: Problem
    new_sessions: tuple[str, ...]
    notes: tuple[str, ...]
    gate: Gate | None = None

    def errors(self, robot: Robot, instrument: Mapping[str, float]) -> tuple[RowErrors, RowErrors]:
        """Errors of a model on the fitted and on the held-out rows.

        Args:
            robot: The model.
            instrument: Places of anchors, contacts or markers that were found with it [m].
        """
        fitted, held = self.problem.data, self.held
        return self.errors_on(fitted, robot, instrument), self.errors_on(held, robot, instrument)

    def errors_on(self, rows: Dataset, robot: Robot, instrument: Mapping[str, float]) -> RowErrors:
        """Errors of a model on some of the fitted or held-out rows; arguments as of `errors`."""
        if not len(rows):
            return RowErrors(*np.zeros((3, 0)))
        return row_errors(
            self.with_new_session_bases(robot, rows), rows, known={**self.problem.known, **instrument}
        )

    @cached_property
    def nominal_rows(self) -> tuple[RowErrors, RowErrors]:
        """Errors of the aligned nominal arm: fitted rows, held-out rows."""
        return self.errors(
            self.aligned, instrument_places(self.aligned, self.problem.data, known=self.problem.known)
        )

    @property
    def shown_noise(self) -> Noise:
        """What weighs the rows, their own sigma included; NaN for rotations that nobody measured."""
        typical = self.problem.typical_noise
        return (
            typical
            if np.isfinite(typical.position)
            else typical._replace(position=self.problem.noise.position)
        )

    def with_new_session_bases(self, robot: Robot, rows: Dataset) -> Robot:
        """The robot with bases for sessions that are not in the fit, estimated from their own rows."""
        new = [name for name in rows.sessions if name in self.new_sessions]
        if not new:
            return robot
        rows = rows.take(np.isin(np.asarray(rows.session), new))
        freedom = FrameFreedom(visible_parts(rows)[0], base_per_session=True)
        own = align(replace(robot, sessions=()), rows, freedom)
        return replace(robot, sessions=(*robot.sessions, *own.sessions))


def prepare(
    robot: Robot,
    data: Dataset,
    choices: FitChoices,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    prior: Prior | None = None,
    effects: Sequence[str] = (),
    seek: Seek | None = None,
    progress: Report | None = None,
    held_rows: Collection[int] | None = None,
    cancel: Cancel | None = None,
) -> Prepared:
    """Everything before the first search; arguments are those of `identify`.

    Args:
        held_rows: Numbers of the rows to hold out, in place of drawing them by `choices`.

    Raises:
        DataError: too few rows, or data that contradict the robot beyond doubt.
        OptionError: an unknown constant or option.
    """
    report = progress or (lambda part, text: None)
    robot.check_joints(data.q, data.source)
    held_out, noise, places = choices.held_out, choices.noise, dict(choices.known)
    sessions = Sessions(choices.frames)
    report(0.0, "checking the rows")
    data = with_drivers(robot, checked(robot, data))
    notes = [*data.notes, *unused_observations(data)]
    rows, excluded = choose_rows(robot, data, choices.exclude, choices.region)
    used = data.take(rows)
    notes += robot.extrapolation_warnings(used.q, used.row)
    train, held = divide(used, held_out, choices.seed) if held_rows is None else _divided(used, held_rows)
    fitted, held_data = used.take(train), used.take(held)
    if isinstance(held_out, Dataset):
        held_data = _other_rows(robot, held_out, choices.region)
    names = tuple(robot.default_free if choices.free is None else choices.free)
    if (length := scale_fixing_length(robot, fitted, names, places)) is not None:
        names = tuple(name for name in names if name != length)
        notes.append(f"contacts show no scale: {length} is held at its nominal value")
    told = () if prior is None else prior.names
    check_enough(robot, fitted, [name for name in (*names, *effects) if name not in told])
    if fitted.rig is not None:
        fitted, train, lost = _suited(robot, fitted, train)
        excluded += lost
        notes += [note for note in fitted.notes if note not in notes]
    report(0.25, "deciding about base and tool")
    choice = choose_frames(
        robot,
        fitted,
        sessions=sessions,
        noise=noise,
        free=names,
        effects=tuple(effects),
        prior=prior,
        known=places,
        cancel=cancel,
    )
    build = partial(Problem.build, frames=choice.freedom, bounds=bounds, known=places, effects=effects)
    gate = None
    if fitted.rig is None:
        problem = build(choice.robot, fitted, free=names, noise=noise)
    else:
        report(0.5, "weighing what pictures may identify")
        problem, gate = select_camera_step(choice.robot, fitted, free=choices.free, build=build, seek=seek)
    if not problem.names:
        raise OptionError("nothing is left to identify; free a constant of the arm, its base or its tool")
    if prior is not None:
        problem, shared = prior.on(problem), sum(name in problem.names for name in prior.names)
        notes.append(f"prior knowledge of {shared} constants from an older calibration")
    report(0.75, "estimating the noise")
    if gate is None:
        problem, noise_note = _with_noise(problem, noise, cancel)
        notes += [*choice.notes, noise_note]
    else:
        notes += [*gate.notes, f"noise from the pictures: {_picture_words(gate.noise)}"]
    if fitted.rig is not None and held_data.rig is not None:
        held_data = with_boards(held_data, [target.owner for target in fitted.rig.targets])
        held_data, held, lost = _in_use(held_data, held)
        if lost and isinstance(held_out, Dataset):
            notes.append(f"{plural(len(lost), 'held-out picture')} left out: no board of the pictures fitted")
        else:
            excluded += lost
    held_data, placing = _placeable(held_data, {**places, **dict.fromkeys(problem.names, 0.0)})
    notes += placing
    new_sessions = _new_sessions(held_data, fitted, choice, sessions)
    if new_sessions:
        notes.append(
            f"held-out session {', '.join(new_sessions)}: where base stands was found from its own rows, "
            "the arm from the others"
        )
    return Prepared(
        data=data,
        train_rows=rows[train],
        held_out_rows=rows[held],
        held=held_data,
        excluded=tuple(excluded),
        aligned=choice.robot,
        problem=problem,
        new_sessions=new_sessions,
        notes=tuple(notes),
        gate=gate,
    )


def _divided(used: Dataset, held_rows: Collection[int]) -> tuple[np.ndarray, np.ndarray]:
    held = np.isin(used.row, list(held_rows))
    return np.flatnonzero(~held), np.flatnonzero(held)


def _suited(robot: Robot, fitted: Dataset, train: np.ndarray):
    """Pictures that suit their joints and show a board that is used, their places, and the others with the
    reason."""
    _check_pictures(fitted)
    lost = mismatched_pictures(robot, fitted)
    keep = ~np.isin(np.arange(len(fitted)), list(lost))
    names = fitted.row if fitted.image is None else fitted.image
    said = [
        (int(fitted.row[i]), f"image {names[i]} does not suit its joints: {1e3 * off:.1f} mm off")
        for i, off in lost.items()
    ]
    if not keep.all():
        fitted, train = fitted.take(keep), train[keep]
    fitted, train, empty = _in_use(with_boards_in_view(fitted, fitted=True), train)
    _check_pictures(fitted)
    return fitted, train, said + empty


def _check_pictures(fitted: Dataset) -> None:
    if len(fitted) < FEWEST_PICTURES:
        raise DataError(
            f"{fitted.source}: {len(fitted)} pictures are left to fit; give at least {FEWEST_PICTURES}"
        )


def _in_use(data: Dataset, places: np.ndarray) -> tuple[Dataset, np.ndarray, list[tuple[int, str]]]:
    """Rows that were not kept out meanwhile, their places (none for another file's), and the others with the
    reason."""
    keep = data.included
    if data.reason is None or keep.all():
        return data, places, []
    said = [(int(data.row[i]), str(data.reason[i])) for i in np.flatnonzero(~keep)]
    return data.take(keep), places[keep] if len(places) else places, said


def _other_rows(robot: Robot, data: Dataset, region: Region | None) -> Dataset:
    """Held-out rows of another file, chosen as the fitted ones are."""
    robot.check_joints(data.q, data.source)
    data = with_drivers(robot, checked(robot, data))
    return data.take(choose_rows(robot, data, {}, region)[0])


def _placeable(held: Dataset, known: Mapping[str, float]) -> tuple[Dataset, list[str]]:
    """Held-out rows whose anchors and contacts the fit or they themselves show, and what is said of it."""
    keep = placed(held, known)
    notes: list[str] = []
    if keep.all():
        return held, notes
    other = np.flatnonzero(~keep)
    columns = [np.asarray(c)[other].astype(str) for c in (held.anchor, held.contact) if c is not None]
    _, label, count = np.unique(np.array(columns), axis=1, return_inverse=True, return_counts=True)
    enough = count[label.ravel()] >= ENOUGH
    keep[other[enough]] = True
    strange = "held-out rows name anchors or contacts that no fitted row has"
    if enough.any():
        where = "their places were found from these rows, the arm from the others"
        notes.append(f"{int(enough.sum())} {strange}: {where}")
    if not enough.all():
        notes.append(f"{int((~enough).sum())} {strange}, fewer than {ENOUGH} each; left out")
    return held.take(keep), notes


def _new_sessions(held: Dataset, fitted: Dataset, choice: FrameChoice, sessions: Sessions) -> tuple[str, ...]:
    """Held-out sessions that no fitted row has, where each may have its own base."""
    if not len(held) or not choice.freedom.base or sessions is Sessions.SHARED:
        return ()
    return tuple(s for s in held.sessions if s not in fitted.sessions)


def _with_noise(problem: Problem, noise: Noise | None, cancel: Cancel | None) -> tuple[Problem, str]:
    """The problem whitened by the noise that was given, that repeats show, or that a fit leaves."""
    own = noises.given_by_rows(problem)
    turned = bool(problem.component_channels.any())
    on_top = ", on top of what rows state" if own is not noises.Given.NONE else ""
    if noise is not None:
        return problem.with_noise(noise), f"noise as given: {_noise_words(noise, turned)}{on_top}"
    repeats = noises.from_repeats(problem.data) if own is noises.Given.NONE else None
    if repeats is not None:
        return problem.with_noise(repeats), f"noise from repeated poses: {_noise_words(repeats, turned)}"
    for _ in range(2 if own is noises.Given.NONE else 5):
        search = Opt2(limit=60).search(problem, on_step=on_step(cancel))
        left = noises.beyond_stated(problem, search.x)
        if left is None:
            words = _noise_words(problem.noise, turned)
            return problem, f"the fit leaves no residual to estimate the noise from; assuming {words}{on_top}"
        converged = np.allclose(left[:2], problem.noise[:2], rtol=0.2, atol=0.0)
        problem = problem.with_noise(left)
        if converged:
            break
    if own is noises.Given.ALL and problem.noise == Noise(0.0, 0.0 if turned else problem.noise.rotation):
        return problem, "noise as the file states it row by row"
    words = _noise_words(problem.noise, turned)
    if own is noises.Given.NONE:
        return problem, f"the rows are weighted by the residuals of the geometry alone: {words}"
    floor = noises.stated(problem)
    said = f" ({_noise_words(floor, turned)})" if floor is not None else ""
    return problem, f"noise as the file states it row by row{said}, and {words} more that the fit leaves"


def _picture_words(noise: Noise) -> str:
    lack = f"{1e3 * noise.position:.2g} mm, {np.rad2deg(noise.rotation):.2g}°"
    return f"corners {noise.pixel:.2f} px; what the model lacks of the tool's pose {lack} about each axis"


def _noise_words(noise: Noise, turned: bool) -> str:
    return (noise if turned else noise._replace(rotation=np.nan)).words


def on_step(cancel: Cancel | None):
    """What a search asks after every step."""
    return None if cancel is None else lambda iteration, cost: cancel()
