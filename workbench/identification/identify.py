"""Identification from end to end: rows chosen, frames decided, noise estimated, fits, held-out errors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Unpack

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
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import ChoiceFields, FitChoices, option
from workbench.identification.preparation import on_step, prepare
from workbench.identification.prior import Prior
from workbench.identification.result import Identification, Run, Validation
from workbench.identification.row_errors import Errors
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
    loss: Loss | str = Loss.SQUARES,
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
        loss: Squares, or a robust loss by rows.
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
    ready = prepare(
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
    runs: dict[str, Run] = {}
    for k, algorithm in enumerate(chosen):
        if runs and cancel is not None and cancel():
            break
        report(
            0.4 + 0.5 * k / len(chosen), f"{algorithm.title}: fitting {len(ready.problem.names)} parameters"
        )
        fit = _fit(ready.problem, algorithm, loss, cancel)
        if (gate := ready.gate) is not None:
            fit = replace(fit, actual=gate.actual, considered=gate.considered)
        train, held = ready.errors(fit.calibrated, fit.problem.instrument(fit.x))
        if ready.gate is not None:
            step = ready.gate.step
            train, held = (errors.widened(step.uncertainty, step.turned) for errors in (train, held))
        runs[algorithm.name] = Run(fit, Errors.of(train), held.summary, train, held)
    report(0.95, "validating")
    nominal = ready.nominal_rows
    report(1.0, "done")
    return Identification(
        nominal_robot=robot,
        aligned=ready.aligned,
        data=ready.data,
        train_rows=ready.train_rows,
        held_out_rows=ready.held_out_rows,
        held_out_data=ready.held,
        excluded=ready.excluded,
        frames=ready.problem.frames,
        noise=ready.shown_noise,
        notes=ready.notes,
        nominal=Validation(Errors.of(nominal[0]), nominal[1].summary),
        nominal_rows=nominal,
        runs=runs,
        gate=ready.gate,
    )


def _algorithm(name: str) -> AbstractIdentifier:
    if name not in ALGORITHMS:
        raise OptionError(f"there is no algorithm '{name}'; choose from {', '.join(ALGORITHMS)}")
    return ALGORITHMS[name]


def _fit(problem, algorithm, loss, cancel) -> Fit:
    began = perf_counter()
    search = algorithm.search(problem, on_step=on_step(cancel))
    weights = np.ones(len(problem.data))
    for _ in range(REWEIGHTINGS if loss is not Loss.SQUARES else 0):
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
