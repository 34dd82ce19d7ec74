"""Identification from end to end: rows chosen, frames decided, noise estimated, fits, held-out errors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, Unpack

import numpy as np

from workbench.arm.posed_arm import posed_arm
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.progress import Cancel, Report
from workbench.base.threads import one_thread
from workbench.base.types import Outcome
from workbench.data.dataset import Dataset
from workbench.identification.algorithms import ALGORITHMS, USUAL, AbstractIdentifier
from workbench.identification.algorithms.robust import Loss, row_weights
from workbench.identification.camera_model_selection import Seek
from workbench.identification.expected_deviation import AUTO, LARGEST, with_expected_deviation
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import ChoiceFields, FitChoices, option
from workbench.identification.preparation import Prepared, on_step, prepare
from workbench.identification.prior import Prior
from workbench.identification.problem import Problem
from workbench.identification.result import Identification, Outlier, Run, Validation
from workbench.identification.row_errors import Errors
from workbench.identification.set_apart import prepare_without_outliers, suspects
from workbench.plate.door import door

REWEIGHTINGS = 10
"""Rounds of a robust loss."""


@door(FitChoices)
@one_thread()
def identify(
    robot: Robot | None,
    data: Dataset,
    choices: FitChoices | None = None,
    *,
    algorithms: Sequence[str] = USUAL,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    loss: Loss | str = Loss.SET_APART,
    deviation: float | str = AUTO,
    prior: Prior | None = None,
    effects: Sequence[str] = (),
    seek: Seek | None = None,
    progress: Report | None = None,
    cancel: Cancel | None = None,
    **fields: Unpack[ChoiceFields],
) -> Identification:
    """Identify the arm's constants, and its frames where they are unknown.

    Args:
        robot: Nominal arm; its frames say whether they are fixed, free, or decided from the data. None
            will do for pictures that come with poses of the tool.
        data: Measurements.
        choices: Rows and frames of the fit; its fields may be given as keywords, such as `held_out=0.2`.
        algorithms: Names from `ALGORITHMS`.
        bounds: Least and greatest value by name, for OPT1.
        loss: Whether rows that no arm explains are set apart, or how the residuals of all rows count.
        deviation: How far the arm's constants are expected from nominal [rad, m]; `auto`: found from the
            rows; infinite: not at all, so that only what no row shows stays nominal.
        prior: What an older calibration knows of the arm's constants.
        effects: Coefficients of the robot's effects to identify with the rest; the others stay as they are.
        seek: Finds effects that pictures may show beside the geometry; None ends with the geometry.
        progress: Called with the part done and what is being done.
        cancel: Asked often; True ends the run with what it has.

    Raises:
        DataError: too few rows, or data that contradict the robot beyond doubt.
        OptionError: an unknown algorithm, constant or option.
    """
    report = progress or (lambda part, text: None)
    if data.rig is not None and data.rig.tool_poses:
        robot = posed_arm()
    if robot is None:
        raise OptionError("only pictures that come with poses of the tool need no robot; give one")
    chosen = [_algorithm(name) for name in algorithms]
    loss = option(Loss, loss, "loss")
    choices = FitChoices.of(choices, **fields)
    sound = prepare_without_outliers if loss is Loss.SET_APART else _all_rows
    ready, apart = sound(
        robot,
        data,
        choices,
        bounds=bounds,
        prior=prior,
        effects=effects,
        seek=seek,
        progress=lambda part, text: report(0.4 * part, text),
        cancel=cancel,
    )
    problem = ready.problem
    if ready.gate is None:
        problem = with_expected_deviation(problem, deviation, cancel=cancel)
    runs: dict[str, Run] = {}
    for k, algorithm in enumerate(chosen):
        if runs and cancel is not None and cancel():
            break
        report(0.4 + 0.5 * k / len(chosen), f"{algorithm.title}: fitting {len(problem.names)} parameters")
        fit = _fit(problem, algorithm, loss, cancel)
        if (gate := ready.gate) is not None:
            fit = replace(fit, actual=gate.actual, considered=gate.considered)
        train, held = ready.errors(fit.calibrated, fit.problem.instrument(fit.x))
        if ready.gate is not None:
            step = ready.gate.step
            train, held = (errors.widened(step.uncertainty, step.turned) for errors in (train, held))
        runs[algorithm.name] = Run(fit, Errors.of(train), held.summary, train, held)
    report(0.95, "validating")
    nominal = ready.nominal_rows
    found = Identification(
        nominal_robot=robot,
        aligned=ready.aligned,
        data=ready.data,
        train_rows=ready.train_rows,
        held_out_rows=ready.held_out_rows,
        held_out_data=ready.held,
        excluded=ready.excluded,
        frames=ready.problem.frames,
        noise=ready.shown_noise,
        notes=(*ready.notes, *_expected(problem, deviation)),
        nominal=Validation(Errors.of(nominal[0]), nominal[1].summary),
        nominal_rows=nominal,
        runs=runs,
        gate=ready.gate,
    )
    best = found.best
    suspect = () if ready.gate is not None else suspects(ready, best.fit)
    report(1.0, "done")
    return replace(
        found, outliers=_errors_of(ready, apart, best.fit), suspects=tuple(ready.held.row[suspect].tolist())
    )


def _expected(problem: Problem, deviation: float | str) -> tuple[str, ...]:
    """What was expected of the constants."""
    if problem.deviation is None or problem.deviation > LARGEST:
        return ()
    found = "from the rows" if deviation == AUTO else "as given"
    size = 1e3 * problem.deviation
    return (f"constants are expected within {size:.2g} mrad or mm of nominal (1 σ, {found})",)


def _all_rows(
    robot: Robot, data: Dataset, choices: FitChoices, **options: Any
) -> tuple[Prepared, np.ndarray]:
    return prepare(robot, data, choices, **options), np.zeros(0, np.int64)


def _errors_of(ready: Prepared, rows: np.ndarray, fit: Fit) -> tuple[Outlier, ...]:
    """Rows that were set apart, the worst first, with their errors under the arm of the others."""
    if not len(rows):
        return ()
    apart = ready.data.take(rows)
    errors = ready.errors_on(apart, fit.calibrated, fit.problem.instrument(fit.x))
    found = map(Outlier, apart.row.tolist(), errors.position.tolist(), errors.rotation.tolist())
    return tuple(sorted(found, key=lambda row: -np.nan_to_num(row.position)))


def _algorithm(name: str) -> AbstractIdentifier:
    if name not in ALGORITHMS:
        raise OptionError(f"there is no algorithm '{name}'; choose from {', '.join(ALGORITHMS)}")
    return ALGORITHMS[name]


def _fit(problem, algorithm, loss, cancel) -> Fit:
    began = perf_counter()
    search = algorithm.search(problem, on_step=on_step(cancel))
    weights = np.ones(len(problem.data))
    for _ in range(REWEIGHTINGS if loss in (Loss.HUBER, Loss.TUKEY) else 0):
        fit = Fit.of(algorithm, problem.with_row_weights(None), search)
        new = row_weights(fit.row_residuals, loss)
        if np.abs(new - weights).max() < 1e-3 or search.outcome is Outcome.CANCELLED:
            break
        weights = new
        problem = problem.with_row_weights(weights)
        search = algorithm.search(problem, on_step=on_step(cancel))
    fit = Fit.of(algorithm, problem, search, seconds=perf_counter() - began)
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
