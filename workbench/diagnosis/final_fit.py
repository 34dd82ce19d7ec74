"""The result that a diagnosis saves: its model refitted on all rows except those that no arm explains.

Held-out errors are those before this refit, which takes place after all decisions. If the file has no
held-out rows, the refit is to the same rows, and the errors are those after it.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.diagnosis.search.refit import MAX_LAST_STEPS, refit
from workbench.diagnosis.search.rounds import Searched
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.errors.expected_deviation import with_expected_deviation
from workbench.identification.errors.saved_arm import SavedArm
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared
from workbench.identification.problem import Problem

MAX_SQUARE_RATIO = 1.1
"""If holding constants makes the mean square this many times larger, they are freed: the rows see what they
move after all, as where a carriage tips about another place than the frame of its slide."""


def fit_with_constants_held(last: Searched) -> Fit:
    """The last search's arm on the same rows, with constants that a rigid arm leaves open held near nominal.

    It is the search's own where masses are no unknowns, or where this does not converge.
    """
    before = last.stage.fit
    if not any(p.unit == "kg" for p in before.problem.parameters):
        return before
    found = _again(last, last.stage.geometric_problem, before.problem.data)
    return before if before.outcome.ok and not found.outcome.ok else found


def geometry_as_identified(fit: Fit) -> Fit:
    """Geometry alone with constants expected near nominal, as `identify` fits it; itself if that fails."""
    problem, algorithm = with_expected_deviation(fit.problem), Opt2(limit=MAX_LAST_STEPS)
    found = Fit(algorithm=algorithm, problem=problem, search=algorithm.search(problem))
    return found if found.outcome.ok else fit


def fitted_on_all(
    ready: Prepared, last: Searched, before: Fit, left_out: Bool[np.ndarray, " rows"]
) -> tuple[Fit, str | None]:
    """The last arm refitted to training and held-out rows, and a note.

    Held-out rows of another file are not used.

    Args:
        ready: The prepared problem and its rows.
        last: The last search, at the fit to be repeated.
        before: The arm that was judged.
        left_out: Held-out rows that are not fitted.
    """
    if not len(ready.held_out_rows):
        return before, None
    if left_out.all():
        return fit_with_constants_held(last), None
    included = np.concatenate([before.problem.data.row, ready.held_out_data.row[~left_out]])
    data, geometric = ready.data.take(np.isin(ready.data.row, included)), last.stage.geometric_problem
    robot = ready.with_new_session_bases(geometric.robot, ready.held_out_data)
    if set(ready.new_sessions) & set(data.sessions):
        robot = replace(robot, sessions={n: robot.sessions.get(n, robot.mounting) for n in data.sessions})
        geometric = replace(geometric, frames=replace(geometric.frames, base_per_session=True))
    found = _again(last, replace(geometric, robot=robot), data)
    if before.outcome.ok and not found.outcome.ok:
        text = f"the refit to all rows did not converge ({found.outcome}); the arm without it is kept"
        return fit_with_constants_held(last), text
    if not last.model:
        found = geometry_as_identified(found)
    out = ", except suspects" if left_out.any() else ""
    return found, (
        f"the arm was refitted to all {len(data)} rows, held-out ones included{out}; held-out errors "
        "are those before this refit"
    )


def best_geometry(fit: Fit, alone: Fit) -> Robot | None:
    """The arm without effects that leaves least of the rows for which the saved arm is valid; None if the fit
    has no effects.

    Either fitted to these rows as `identify` does, or to the predictions of the arm with effects. Masses and
    gravity are as given: they were unknowns for the sake of the effects of load alone.

    Args:
        fit: An arm with effects.
        alone: Geometry alone, which says how far the rows are from it.
    """
    problem, arm = fit.problem, fit.calibrated
    if not arm.effects:
        return None
    angles = (p for p in problem.parameters if p.name.startswith("gravity"))
    given = problem.robot if all(p.is_inertia for p in angles) else arm
    saved, known = SavedArm(arm, problem.data), {**problem.known, **problem.instrument(fit.x)}
    rows, bare = saved.valid_for(problem.data), problem.robot.with_effects()
    noise = alone.problem.noise
    plain = problem.again(robot=bare, data=rows, effects=(), inertia=False, noise=noise)
    plain = with_expected_deviation(plain)
    fitted = plain.robot_at(Opt2(limit=MAX_LAST_STEPS).search(plain).x)
    left = {}
    for geometry in (fitted.weighed_as(given), saved.formats["URDF"].weighed_as(given)):
        mine = SavedArm(arm.recorded(geometry=geometry), rows)
        left[geometry] = mine.errors(rows, known, mine.formats["URDF"]).main.mean
    return min(left, key=left.__getitem__)


def _again(last: Searched, geometric: Problem, data: Dataset) -> Fit:
    """The last model fitted to some rows, constants that a rigid arm leaves open held near nominal.

    They are let go where holding them leaves more; whether more than the search left is only why that is
    tried, as rows that were held out may be worse whether constants are held or not.
    """
    before = last.stage.fit

    def fitted(*, holds: bool) -> Fit:
        return refit(
            geometric,
            last.grams,
            last.model,
            data=data,
            begin=before.problem.named(before.x),
            steps=MAX_LAST_STEPS,
            holds=holds,
            flat=True,
        ).fit

    held = fitted(holds=True)
    if _mean_square(held) <= MAX_SQUARE_RATIO * _mean_square(before):
        return held
    free = fitted(holds=False)
    return free if _mean_square(held) > MAX_SQUARE_RATIO * _mean_square(free) else held


def _mean_square(fit: Fit) -> float:
    """Of the whitened residuals that a fit leaves."""
    residual = fit.problem.residual(fit.x)[: fit.problem.size]
    return float(residual @ residual) / fit.problem.count
