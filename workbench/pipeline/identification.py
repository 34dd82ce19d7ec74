"""Identification from end to end: rows chosen, frames decided, noise estimated, fits, held-out errors."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from workbench.design.region import Region
from workbench.errors import OptionError
from workbench.identify import noise as noises
from workbench.identify.alignment import align
from workbench.identify.frames import Sessions, choose_frames, visible_parts
from workbench.identify.identifier import AbstractIdentifier
from workbench.identify.ols import Ols
from workbench.identify.opt1 import Opt1
from workbench.identify.opt2 import Opt2
from workbench.identify.prior import Prior
from workbench.identify.problem import FrameFreedom, Noise, Problem
from workbench.identify.result import Fit
from workbench.identify.robust import Loss, row_weights
from workbench.measure.dataset import Dataset
from workbench.measure.plausible import check_plausible
from workbench.pipeline.rows import (
    check_enough,
    choose_rows,
    divide,
    held_scale,
    placed,
    unused_observations,
)
from workbench.robots.robot import Robot
from workbench.types import Outcome
from workbench.validate.errors import Errors, RowErrors, instrument_fit, row_errors
from workbench.validate.identification import Identification, Run, Validation

ALGORITHMS: dict[str, AbstractIdentifier] = {a.name: a for a in (Ols(), Opt1(), Opt2())}
"""The identification algorithms by name; a new one is one more file and one more entry."""
REWEIGHTINGS = 10
"""Rounds of a robust loss."""

Progress = Callable[[float, str], None]
Cancel = Callable[[], bool]


def identify(
    robot: Robot,
    data: Dataset,
    *,
    algorithms: Sequence[str] = ("ols", "opt1", "opt2"),
    held_out: float | Dataset | tuple[str, ...] = 0.2,
    frames: Sessions | str = Sessions.AUTO,
    free: Sequence[str] | None = None,
    exclude: Mapping[int, str] | None = None,
    region: Region | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    noise: Noise | None = None,
    loss: Loss | str = Loss.SQUARES,
    prior: Prior | None = None,
    known: Mapping[str, float] | None = None,
    effects: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Identification:
    """Identify the arm's constants, and its frames where they are unknown.

    Args:
        robot: Nominal arm; its frames say whether they are fixed, free, or decided from the data.
        data: Measurements.
        algorithms: Names from `ALGORITHMS`.
        held_out: Share of rows to hold out, rows of another file, or names of sessions.
        frames: Whether sessions share base and tool, have their own, or the data decide.
        free: Constants to identify; the robot's default ones if None.
        exclude: Rows to keep out, with the reason.
        region: Keep only rows whose nominal tool position lies in this cuboid of the robot's base frame.
        bounds: Least and greatest value by name, for OPT1.
        noise: Standard deviations [m], [rad]; from repeats or the fit if None.
        loss: Squares, or a robust loss by rows.
        prior: What an older calibration knows of the arm's constants.
        known: Known places of anchors or contacts [m], such as `anchor[A].x`.
        effects: Coefficients of the robot's effects to identify with the rest; the others stay as they are.
        seed: Chooses the held-out rows.
        progress: Called with the part done and what is being done.
        cancel: Asked often; True ends the run with what it has.

    Raises:
        DataError: too few rows, or data that contradict the robot beyond doubt.
        OptionError: an unknown algorithm, constant or option.
    """
    report = progress or (lambda part, text: None)
    chosen = [_algorithm(name) for name in algorithms]
    robot.check_joints(data.q, data.source)
    loss, sessions = _option(Loss, loss, "loss"), _option(Sessions, frames, "frames")
    report(0.0, "checking the rows")
    data = check_plausible(data, robot.limits, robot.reach)
    notes = [*data.notes, *unused_observations(data)]
    rows, excluded = choose_rows(robot, data, exclude or {}, region)
    used = data.take(rows)
    train, held = divide(used, held_out, seed)
    fitted, held_data = used.take(train), used.take(held)
    if isinstance(held_out, Dataset):
        held_data = _other_rows(robot, held_out, region)
    names = tuple(robot.default_free if free is None else free)
    places = dict(known or {})
    if (length := held_scale(robot, fitted, names, places)) is not None:
        names = tuple(name for name in names if name != length)
        notes.append(f"contacts show no scale: {length} is held at its nominal value")
    check_enough(robot, fitted, (*names, *effects))
    report(0.1, "deciding about base and tool")
    choice = choose_frames(
        robot,
        fitted,
        sessions=sessions,
        noise=noise,
        free=names,
        effects=tuple(effects),
        known=places,
        cancel=cancel,
    )
    problem = Problem.build(
        choice.robot,
        fitted,
        free=names,
        frames=choice.freedom,
        noise=noise,
        bounds=bounds,
        known=places,
        effects=effects,
    )
    if not problem.names:
        raise OptionError("nothing is left to identify; free a constant of the arm, its base or its tool")
    if prior is not None:
        problem, prior_note = _with_prior(problem, prior)
        notes.append(prior_note)
    report(0.3, "estimating the noise")
    problem, noise_note = _with_noise(problem, noise, cancel)
    notes += [*choice.notes, noise_note]
    held_data, unplaced = _seen_places(held_data, {**places, **dict.fromkeys(problem.names, 0.0)})
    strangers = tuple(s for s in held_data.sessions if s not in fitted.sessions) if len(held_data) else ()
    strangers = strangers if choice.freedom.base and sessions is not Sessions.SHARED else ()
    if strangers:
        notes.append(
            f"held-out session {', '.join(strangers)}: where base stands was found from its own rows, "
            "the arm from the others"
        )
    if unplaced:
        notes.append(f"{unplaced} held-out rows name anchors or contacts that no fitted row has; left out")
    runs: dict[str, Run] = {}
    for k, algorithm in enumerate(chosen):
        if runs and cancel is not None and cancel():
            break
        report(0.4 + 0.5 * k / len(chosen), f"{algorithm.title}: fitting {len(problem.names)} parameters")
        fit = _fit(problem, algorithm, loss, cancel)
        pairs = zip(fit.problem.parameters, fit.x.tolist(), strict=True)
        found = places | {p.name: value for p, value in pairs if p.is_instrument}
        arm = _at_home(fit.calibrated, held_data, strangers)
        train_rows, held_rows = _errors(fit.calibrated, fitted, found), _errors(arm, held_data, found)
        runs[algorithm.name] = Run(fit, Errors.of(train_rows), held_rows.summary, train_rows, held_rows)
    report(0.95, "validating")
    before = Problem.build(choice.robot, fitted, free=(), known=places)
    found = places | dict(zip(before.names, instrument_fit(before).tolist(), strict=True))
    arm = _at_home(choice.robot, held_data, strangers)
    nominal = _errors(choice.robot, fitted, found), _errors(arm, held_data, found)
    report(1.0, "done")
    turned = bool(problem.component_channels.any())
    return Identification(
        robot=robot,
        aligned=choice.robot,
        data=data,
        train_rows=rows[train],
        held_out_rows=rows[held],
        held_out_data=held_data,
        excluded=tuple(excluded),
        frames=choice.freedom,
        noise=problem.noise if turned else problem.noise._replace(rotation=np.nan),
        notes=tuple(notes),
        nominal=Validation(Errors.of(nominal[0]), nominal[1].summary),
        nominal_rows=nominal,
        runs=runs,
    )


def _algorithm(name: str) -> AbstractIdentifier:
    if name not in ALGORITHMS:
        raise OptionError(f"there is no algorithm '{name}'; choose from {', '.join(ALGORITHMS)}")
    return ALGORITHMS[name]


def _option(kind, value, what: str):
    try:
        return kind(value)
    except ValueError:
        raise OptionError(f"{what} can't be '{value}'; choose from {', '.join(kind)}") from None


def _other_rows(robot: Robot, data: Dataset, region: Region | None) -> Dataset:
    """Held-out rows of another file, chosen as the fitted ones are."""
    robot.check_joints(data.q, data.source)
    data = check_plausible(data, robot.limits, robot.reach)
    return data.take(choose_rows(robot, data, {}, region)[0])


def _seen_places(held: Dataset, known: Mapping[str, float]) -> tuple[Dataset, int]:
    """Held-out rows whose anchors and contacts the fit knows, and how many others there were."""
    keep = placed(held, known)
    return held.take(keep), int((~keep).sum())


def _at_home(robot: Robot, held: Dataset, strangers: tuple[str, ...]) -> Robot:
    """The robot with bases for sessions that took no part in the fit, from their own rows."""
    if not strangers:
        return robot
    rows = held.take(np.isin(np.asarray(held.session), strangers))
    freedom = FrameFreedom(visible_parts(rows)[0], base_per_session=True)
    own = align(replace(robot, sessions=()), rows, freedom)
    return replace(robot, sessions=(*robot.sessions, *own.sessions))


def _with_prior(problem: Problem, prior: Prior) -> tuple[Problem, str]:
    """The problem with what an older calibration knows of the constants that are identified now."""
    shared = prior.keep(lambda name: name in problem.names)
    if not shared.names:
        raise OptionError("the prior knowledge speaks of none of the constants that are identified here")
    return (
        problem.with_prior(shared.names, shared.values, shared.whitening),
        f"prior knowledge of {len(shared.names)} constants from an older calibration",
    )


def _with_noise(problem: Problem, noise: Noise | None, cancel: Cancel | None) -> tuple[Problem, str]:
    """The problem whitened by the noise that was given, that repeats show, or that a fit leaves."""
    own = noises.given_by_rows(problem)
    turned = bool(problem.component_channels.any())
    if own is noises.Given.ALL:
        return problem, "noise as given row by row in the file"
    rest = ", where a row brings none of its own" if own is noises.Given.SOME else ""
    if noise is not None:
        return problem, f"noise as given: {_noise_words(noise, turned)}{rest}"
    repeats = noises.from_repeats(problem.data)
    if repeats is not None:
        return problem.with_noise(
            repeats
        ), f"noise from repeated poses: {_noise_words(repeats, turned)}{rest}"
    for _ in range(2):
        search = Opt2(limit=60).search(problem, on_step=_on_step(cancel))
        left = noises.from_fit(problem, search)
        if left is None:
            return (
                problem,
                f"the fit leaves nothing to tell noise from; weights: {_noise_words(problem.noise, turned)}",
            )
        change = np.abs(np.log(np.array(left) / np.array(problem.noise))).max()
        problem = problem.with_noise(left)
        if change < 0.2:
            break
    return problem, f"noise from what the fit leaves: {_noise_words(problem.noise, turned)}{rest}"


def _noise_words(noise: Noise, turned: bool) -> str:
    rotation = f", {np.rad2deg(noise.rotation):.2g}°" if turned else ""
    return f"{1e3 * noise.position:.3g} mm{rotation}"


def _on_step(cancel: Cancel | None):
    return None if cancel is None else lambda iteration, cost: cancel()


def _fit(problem, algorithm, loss, cancel) -> Fit:
    began = perf_counter()
    search = algorithm.search(problem, on_step=_on_step(cancel))
    weights = np.ones(len(problem.data))
    for _ in range(REWEIGHTINGS if loss is not Loss.SQUARES else 0):
        fit = Fit(
            algorithm=algorithm.name,
            title=algorithm.title,
            problem=problem.with_row_weights(None),
            x=search.x,
            outcome=search.outcome,
            history=search.history,
            seconds=0.0,
        )
        new = row_weights(fit.row_residuals, loss)
        if np.abs(new - weights).max() < 1e-3 or search.outcome is Outcome.CANCELLED:
            break
        weights = new
        problem = problem.with_row_weights(weights)
        search = algorithm.search(problem, on_step=_on_step(cancel))
    fit = Fit(
        algorithm=algorithm.name,
        title=algorithm.title,
        problem=problem,
        x=search.x,
        outcome=search.outcome,
        history=search.history,
        seconds=perf_counter() - began,
    )
    return replace(fit, warnings=_warnings(fit))


def _warnings(fit: Fit) -> tuple[str, ...]:
    """What went wrong with one algorithm's search."""
    found = []
    if not fit.outcome.ok:
        found.append(f"{fit.title}: {fit.outcome}")
    if fit.at_bounds:
        found.append(
            f"{fit.title}: on its bound: {', '.join(fit.at_bounds)}; widen the bounds if that is wrong"
        )
    if fit.beyond_bounds:
        found.append(
            f"{fit.title} knows no bounds: {', '.join(fit.beyond_bounds)} lies beyond; OPT1 keeps them"
        )
    return tuple(found)


def _errors(robot: Robot, data: Dataset, known: Mapping[str, float]) -> RowErrors:
    if not len(data):
        return RowErrors(np.zeros(0), np.zeros(0))
    return row_errors(robot, data, known=known or None)
