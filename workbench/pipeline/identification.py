"""Identification from end to end: rows chosen, frames decided, noise estimated, fits, held-out errors."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from workbench.design.region import Region
from workbench.errors import DataError, OptionError
from workbench.identify import noise as noises
from workbench.identify.frames import FrameChoice, Sessions, choose_frames
from workbench.identify.identifier import AbstractIdentifier
from workbench.identify.linear import factorise
from workbench.identify.ols import Ols
from workbench.identify.opt1 import Opt1
from workbench.identify.opt2 import Opt2
from workbench.identify.problem import Noise, Problem
from workbench.identify.result import Fit
from workbench.identify.robust import Loss, row_weights
from workbench.measure.dataset import Dataset
from workbench.measure.plausible import check_plausible
from workbench.model.forward import tool_poses
from workbench.robots.robot import Frame, Robot
from workbench.types import Outcome
from workbench.validate.errors import Errors, RowErrors, row_errors
from workbench.validate.holdout import split, split_sessions
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
    prior: tuple[Sequence[str], np.ndarray] | None = None,
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
        prior: Names and covariance [rad, m] of an older calibration around the nominal values.
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
    notes = list(data.notes)
    rows, excluded = _choose_rows(robot, data, exclude or {}, region)
    used = data.take(rows)
    train, held = _divide(used, held_out, seed)
    held_data = used.take(held)
    if isinstance(held_out, Dataset):
        robot.check_joints(held_out.q, held_out.source)
        held_data = check_plausible(held_out, robot.limits, robot.reach)
        held_data = held_data.take(held_data.included)
    fitted = used.take(train)
    _check_enough(robot, fitted, free, effects)
    report(0.1, "deciding about base and tool")
    choice = choose_frames(
        robot,
        fitted,
        sessions=sessions,
        noise=noise,
        free=None if free is None else tuple(free),
        effects=tuple(effects),
    )
    problem = Problem.build(
        choice.robot,
        fitted,
        free=free,
        frames=choice.freedom,
        noise=noise,
        bounds=bounds,
        known=known,
        effects=effects,
    )
    if prior is not None:
        problem, prior_note = _with_prior(problem, prior)
        notes.append(prior_note)
    report(0.3, "estimating the noise")
    problem, noise_note = _with_noise(problem, noise, cancel)
    notes += [*choice.notes, noise_note]
    runs: dict[str, Run] = {}
    for k, algorithm in enumerate(chosen):
        report(0.4 + 0.5 * k / len(chosen), f"{algorithm.title}: fitting {len(problem.names)} parameters")
        fit = _fit(problem, algorithm, loss, cancel, excluded_rows=rows[train])
        runs[algorithm.name] = _validated(fit, fitted, held_data, choice)
    report(0.95, "validating")
    nominal = [_errors(choice.robot, part, {}) for part in (fitted, held_data)]
    report(1.0, "done")
    return Identification(
        robot=robot,
        aligned=choice.robot,
        data=data,
        train_rows=rows[train],
        held_out_rows=rows[held],
        held_out_data=held_data,
        excluded=tuple(excluded),
        frames=choice.freedom,
        noise=problem.noise,
        notes=tuple(notes),
        nominal=Validation(Errors.of(nominal[0]), nominal[1].summary),
        nominal_rows=(nominal[0], nominal[1]),
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


def _choose_rows(robot, data, exclude, region) -> tuple[np.ndarray, list[tuple[int, str]]]:
    """Rows to use, and those kept out with their reasons."""
    keep = data.included.copy()
    excluded = [
        (int(data.row[i]), str(data.reason[i]) if data.reason is not None and data.reason[i] else "file")
        for i in np.flatnonzero(~keep)
    ]
    for row, reason in exclude.items():
        place = np.flatnonzero(data.row == row)
        if not len(place):
            raise OptionError(f"there is no row {row} to exclude; rows are 0 … {int(data.row.max())}")
        if keep[place[0]]:
            keep[place[0]] = False
            excluded.append((int(row), reason))
    if region is not None:
        arm = robot.with_frames(base=Frame())
        outside = keep & ~region.contains(tool_poses(arm.with_effects(), data.q)[:, :3, 3])
        excluded += [(int(r), "outside the region") for r in data.row[outside]]
        keep &= ~outside
    if not keep.any():
        raise DataError(f"{data.source}: every row is excluded or outside the region; nothing is left to fit")
    return np.flatnonzero(keep), excluded


def _divide(used: Dataset, held_out, seed: int) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(held_out, Dataset):
        return np.arange(len(used)), np.arange(0)
    if isinstance(held_out, tuple):
        return split_sessions(used, held_out)
    return split(used, held_out, rng=np.random.default_rng(seed))


def _check_enough(robot: Robot, data: Dataset, free, effects) -> None:
    """Refuse a fit of more parameters than measured numbers."""
    count = len(robot.default_free if free is None else free) + len(effects)
    problem = Problem.build(robot, data, free=())
    if problem.size < count:
        need = int(np.ceil(count / (problem.size / len(data))))
        raise DataError(
            f"{data.source}: {len(data)} rows give {problem.size} numbers for {count} parameters of the arm; "
            f"measure at least {need} poses, hold fewer out, or free fewer parameters"
        )


def _with_prior(problem: Problem, prior: tuple[Sequence[str], np.ndarray]) -> tuple[Problem, str]:
    """The problem with what an older calibration knows of the constants that are identified now."""
    names, covariance = prior
    shared = [i for i, name in enumerate(names) if name in problem.names]
    if not shared:
        raise OptionError("the prior knowledge speaks of none of the constants that are identified here")
    kept = [names[i] for i in shared]
    return (
        problem.with_prior(kept, covariance[np.ix_(shared, shared)]),
        f"prior knowledge of {len(kept)} constants from an older calibration",
    )


def _with_noise(problem: Problem, noise: Noise | None, cancel: Cancel | None) -> tuple[Problem, str]:
    """The problem whitened by the noise that was given, that repeats show, or that a fit leaves."""
    if noise is not None:
        return problem, f"noise as given: {_noise_words(noise)}"
    if problem.data.sigma is not None and np.isfinite(problem.data.sigma[:, 0]).all():
        return problem, "noise as given row by row in the file"
    repeats = noises.from_repeats(problem.data)
    if repeats is not None:
        return problem.with_noise(repeats), f"noise from repeated poses: {_noise_words(repeats)}"
    for _ in range(2):
        search = Opt2(limit=60).search(problem, on_step=_on_step(cancel))
        rank = factorise(*reversed(problem.evaluate(search.x))).rank
        left = noises.from_fit(problem, search, rank)
        if left is None:
            return problem, f"the fit leaves no noise; weighed as {_noise_words(problem.noise)}"
        change = np.abs(np.log(np.array(left) / np.array(problem.noise))).max()
        problem = problem.with_noise(left)
        if change < 0.2:
            break
    return problem, f"noise from what the fit leaves: {_noise_words(problem.noise)}"


def _noise_words(noise: Noise) -> str:
    return f"{1e3 * noise.position:.3g} mm, {np.rad2deg(noise.rotation):.2g}°"


def _on_step(cancel: Cancel | None):
    return None if cancel is None else lambda iteration, cost: cancel()


def _fit(problem, algorithm, loss, cancel, *, excluded_rows) -> Fit:
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
    return tuple(found)


def _validated(fit: Fit, fitted: Dataset, held: Dataset, choice: FrameChoice) -> Run:
    pairs = zip(fit.problem.parameters, fit.x.tolist(), strict=True)
    known = {p.name: value for p, value in pairs if p.is_instrument}
    train, held_out = (_errors(fit.calibrated, part, known) for part in (fitted, held))
    return Run(fit, Errors.of(train), held_out.summary, train, held_out)


def _errors(robot: Robot, data: Dataset, known: Mapping[str, float]) -> RowErrors:
    if not len(data):
        return RowErrors(np.zeros(0), np.zeros(0))
    return row_errors(robot, data, known=known or None)
