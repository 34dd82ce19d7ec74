"""Identification from end to end: choose rows, decide frames, estimate noise, fit, judge on held-out rows."""

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Unpack

import numpy as np
from jaxtyping import Float

import workbench.identification.report.document  # noqa: F401 how results are shown
from workbench.arm.built_in_arms import posed_arm
from workbench.base.advice import beside
from workbench.base.arguments import checked_arguments, with_fields
from workbench.base.errors import OptionError
from workbench.base.progress import cancelled, part_of, progress
from workbench.base.threads import one_thread
from workbench.base.wording import plural
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.identification.algorithms import (
    ALGORITHMS,
    DEFAULT_ALGORITHMS,
    FURTHER_ALGORITHMS,
    AbstractIdentifier,
)
from workbench.identification.errors.expected_deviation import AUTO, MAX_DEVIATION, with_expected_deviation
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import ChoiceFields, FitChoices, choices_as_read
from workbench.identification.meaning.as_read import as_read
from workbench.identification.preparation import Prepared
from workbench.identification.prior import Prior
from workbench.identification.problem import Problem
from workbench.identification.result import Identification
from workbench.identification.rows.excluded_outliers import REASONS, prepare_without_outliers
from workbench.identification.run import Run
from workbench.identification.tool_observability import observed_by


@checked_arguments(FitChoices)
@one_thread()
def identify(
    robot: RobotLike | None,
    data: DatasetLike,
    choices: FitChoices | None = None,
    *,
    algorithms: Sequence[str] = DEFAULT_ALGORITHMS,
    set_apart: bool = True,
    deviation: float | str = AUTO,
    prior: Prior | None = None,
    effects: Sequence[str] = (),
    **fields: Unpack[ChoiceFields],
) -> Identification:
    """Identify the arm's constants, and its frames where they are unknown.

    Args:
        robot: Nominal arm; its frames say whether they are fixed, free, or decided from the data. May be None
            if the rows hold tool poses instead of joints, as pictures do; a robot given with these is
            ignored.
        data: Measurements.
        choices: Rows and frames of the fit; its fields may be given as keywords, such as `held_out=0.2`,
            where `choices` does not set them.
        algorithms: Names from `ALGORITHMS`. The default is joined by OPT1 and OPT2 where it does not
            converge.
        set_apart: Whether outliers are excluded; else they weigh as all other rows.
        deviation: Expected deviation of the arm's constants from nominal [rad, m]; `auto`: estimated from the
            rows; infinite: no prior, so that only unobservable constants stay nominal.
        prior: Knowledge of the arm's constants from an earlier calibration.
        effects: Coefficients of the robot's effects to identify as well; the others keep their values.

    Raises:
        DataError: too few rows, or data that contradict the robot beyond doubt.
        OptionError: an unknown algorithm, constant or option.
    """
    if data.readings is not None and data.readings.has_tool_poses:
        robot = posed_arm()
    if robot is None:
        raise OptionError("give a robot; it may be omitted only for rows with tool poses instead of joints")
    chosen = _algorithms(algorithms)
    choices = with_fields(FitChoices, choices, fields)
    robot, data, _ = as_read(robot, data, choices.reading, exclude=choices.exclude)
    choices = choices_as_read(robot, choices)
    with part_of(0.0, 0.4):
        ready, outlying = prepare_without_outliers(
            robot, data, choices, reasons=REASONS if set_apart else (), prior=prior, effects=effects
        )
    problem, begin = ready.problem, None
    if not ready.identifiability.is_limited:
        some, first = ready.first_fit
        likely = with_expected_deviation(some, deviation, x=first.x).deviation
        problem = ready.shared.with_deviation(likely)
        if len(chosen) == 1 and first.outcome.ok and first.factor and first.factor.seen.all():
            begin = first.x  # several are compared, and what is hardly observable stays where it starts
    runs = _runs(ready, problem, chosen, begin)
    alone = next(iter(runs.values())).fit
    if tuple(algorithms) == DEFAULT_ALGORITHMS and not alone.outcome.ok:
        runs |= _runs(ready, problem, _algorithms(FURTHER_ALGORITHMS))
    progress(1.0, "done")
    return Identification(
        nominal_robot=robot,
        aligned=ready.aligned,
        data=ready.data,
        **ready.split | {"notes": (*ready.notes, *_prior_note(problem, deviation))},
        nominal=ready.nominal,
        runs=runs,
        ready=ready,
        outlying=outlying,
    )


def _runs(
    ready: Prepared,
    problem: Problem,
    algorithms: Sequence[AbstractIdentifier],
    begin: Float[np.ndarray, " p"] | None = None,
) -> dict[str, Run]:
    """Fit with each algorithm and compute errors; if cancelled, stop before the next algorithm."""
    runs: dict[str, Run] = {}
    for k, algorithm in enumerate(algorithms):
        if runs and cancelled():
            break
        share = 0.4 + 0.5 * k / len(algorithms)
        progress(share, f"{algorithm.title}: fitting {plural(len(problem.names), 'parameter')}")
        began, decided = perf_counter(), ready.identifiability
        search = algorithm.search(problem, begin=begin)
        fit = Fit(algorithm=algorithm, problem=problem, search=search, seconds=perf_counter() - began)
        fit = replace(ready.scaled(fit), actual=decided.actual, considered=decided.considered)
        found, new = ready.errors(fit.arm, fit.problem.instrument(fit.x)), ready.new_mountings(fit.arm)
        known = observed_by(fit).tool if decided.is_limited else (0.0, 0.0)
        train, held = (each.widened(*known) for each in (found.train, found.held_out))
        runs[algorithm.name] = Run(train, held, fit, ready.held_out_data, new_sessions=new)
    return runs


@beside("the note on the prior", ())
def _prior_note(problem: Problem, deviation: float | str) -> tuple[str, ...]:
    """A note on the prior deviation of the constants."""
    if problem.deviation is None or problem.deviation > MAX_DEVIATION:
        return ()
    found = "estimated from the rows" if deviation == AUTO else "as given"
    return (f"prior: constants within ±{1e3 * problem.deviation:.2g} mrad or mm of nominal (1 σ, {found})",)


def _algorithms(names: Sequence[str]) -> list[AbstractIdentifier]:
    wrong = [name for name in names if name not in ALGORITHMS]
    if wrong or not names:
        what = f"unknown algorithm '{wrong[0]}'" if wrong else "no algorithm is given"
        raise OptionError(f"{what}; choose from {', '.join(ALGORITHMS)}", option="algorithms", found=names)
    return [ALGORITHMS[name] for name in names]
