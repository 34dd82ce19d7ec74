"""The result that a diagnosis saves: its model refitted on all rows except those that no arm explains.

Held-out errors are those before this refit, which takes place after all decisions. If the file has no
held-out rows, the refit is to the same rows, and the errors are those after it.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Bool

from workbench.data.dataset import Dataset
from workbench.diagnosis.search.refit import MAX_LAST_STEPS, refit
from workbench.diagnosis.search.rounds import Searched
from workbench.identification.algorithms.opt2_levenberg_marquardt import Opt2
from workbench.identification.errors.expected_deviation import with_expected_deviation
from workbench.identification.fit import Fit
from workbench.identification.preparation import Prepared
from workbench.identification.problem import Noise, Problem
from workbench.identification.run import IMPLAUSIBLE_LENGTH

MAX_SQUARE_RATIO = 1.1
"""If holding constants makes the mean square this many times larger, they are freed: the rows see what they
move after all, as where a carriage tips about another place than the frame of its slide."""


def fit_as_saved(last: Searched, still: Dataset | None = None) -> Fit:
    """The last search's arm fitted to the same rows as it is saved: as from a measuring frame at rest if
    there are such rows, with constants expected near nominal; the search's own if this does not converge.
    """
    before, data = last.stage.fit, last.stage.problem.data
    if still is not None:
        data = still.take(np.isin(still.row, data.row))
    elif not last.model:
        return before
    found = _again(last, last.stage.geometric_problem, data)
    return before if before.outcome.ok and not found.outcome.ok else found


def geometry_as_identified(fit: Fit, noise: Noise | None) -> Fit:
    """Geometry alone with constants expected near nominal, as `identify` fits it; itself if that fails.

    Joint readings that scatter weigh rows only if these, each left out in turn, are predicted better so than
    with the noise that `identify` assumes, if it is known: that of all rows, where none is an outlier.
    """
    weighings = [noise or fit.problem.noise._replace(joints=())]
    weighings += [fit.problem.noise] if any(fit.problem.noise.joints) else []
    found = [each for n in weighings if (each := identified(fit.problem.with_noise(n))).outcome.ok]
    return min(found, key=_surprise) if len(found) > 1 else next(iter(found), fit)


def identified(problem: Problem) -> Fit:
    """The fit with constants expected near nominal."""
    algorithm, problem = Opt2(limit=MAX_LAST_STEPS), with_expected_deviation(problem)
    return Fit(algorithm=algorithm, problem=problem, search=algorithm.search(problem))


def _surprise(fit: Fit) -> float:
    """Negative log likelihood of the rows, each left out in turn, with the noise that this shows."""
    problem, at = fit.problem, fit.problem.evaluate(fit.x)
    half, out = at.jacobian[: problem.size] @ fit.factor.root, np.empty(problem.size)
    for block in problem.blocks:
        rows, shape = slice(block.start, block.stop), block.inverse_sigma.shape
        mine = half[rows].reshape(*shape, -1)
        free = np.eye(shape[1]) - mine @ mine.transpose(0, 2, 1)
        out[rows] = np.linalg.solve(free, at.residual[rows].reshape(*shape, 1)).ravel()
    squares = problem.physical(out) ** 2
    return float(
        sum(0.5 * mine.sum() * np.log(squares[mine].mean()) for mine in problem.channels if mine.any())
    )


def fitted_on_all(
    ready: Prepared, last: Searched, before: Fit, left_out: Bool[np.ndarray, " rows"], still: Dataset | None
) -> tuple[Fit, str | None]:
    """The last arm refitted to training and held-out rows but those left out, as from a measuring frame at
    rest if there are such rows, and a note.

    Held-out rows of another file are not used.
    """
    if not len(ready.held_out_rows):
        return before, None
    if left_out.all():
        return before, None
    included = np.concatenate([before.problem.data.row, ready.held_out_data.row[~left_out]])
    data = (still or ready.data).take(np.isin(ready.data.row, included))
    geometric = last.stage.geometric_problem
    robot = ready.with_new_session_bases(geometric.robot, ready.held_out_data)
    if set(ready.new_sessions) & set(data.sessions):
        robot = replace(robot, sessions={n: robot.sessions.get(n, robot.mounting) for n in data.sessions})
        geometric = replace(geometric, frames=replace(geometric.frames, base_per_session=True))
    found = _again(last, replace(geometric, robot=robot), data)
    if before.outcome.ok and not found.outcome.ok:
        text = f"the refit to all rows did not converge ({found.outcome}); the arm without it is kept"
        return before, text
    if not last.model:
        found = geometry_as_identified(found, ready.problem.noise if last.stage.keep.all() else None)
    out = ", except suspects" if left_out.any() else ""
    return found, (
        f"the arm{' with these effects' * bool(last.model)} was refitted to all {len(data)} rows, held-out "
        f"ones included{out}; held-out errors are those before this refit"
    )


def _again(last: Searched, geometric: Problem, data: Dataset) -> Fit:
    """The last model fitted to some rows, constants that a rigid arm leaves open held near nominal.

    They are let go where holding them leaves more and none goes farther than those of an arm; whether more
    than the search left is only why that is tried, as rows that were held out may be worse anyway.
    """
    before = last.stage.fit
    starts = [before.problem.named(before.x)]
    again = partial(refit, geometric, last.grams, last.model, data=data, starts=starts, is_final=True)
    held = again(holds=True)
    is_held = any(p.unit == "kg" for p in held.problem.parameters)
    if not is_held or _mean_square(held) <= MAX_SQUARE_RATIO * _mean_square(before):
        return held
    free = again(holds=False)
    each = zip(free.problem.parameters, free.x.tolist(), strict=True)
    moved = max((abs(x - p.nominal) for p, x in each if p.is_geometry and p.unit == "m"), default=0.0)
    is_better = _mean_square(held) > MAX_SQUARE_RATIO * _mean_square(free)
    return free if is_better and moved < IMPLAUSIBLE_LENGTH else held


def _mean_square(fit: Fit) -> float:
    """Of the whitened residuals that a fit leaves."""
    residual = fit.problem.residual(fit.x)[: fit.problem.size]
    return float(residual @ residual) / fit.problem.count
