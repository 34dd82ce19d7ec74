"""Outliers, excluded before base, tool, noise and constants are estimated from the other rows.

First gross outliers, too large for manufacturing errors, among all rows: they would distort even base and
tool. Then, among the rows to fit only, those that stand out from a robust fit. Held-out outliers are reported
and kept.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.base.remedy import remedy
from workbench.base.wording import first_of
from workbench.data.dataset import Dataset
from workbench.identification.errors.expected_deviation import MAX_DEVIATION
from workbench.identification.errors.row_errors import Errors, instrument_places
from workbench.identification.fit import Fit
from workbench.identification.fit_choices import FitChoices
from workbench.identification.preparation import Prepared, prepare
from workbench.identification.problem import Problem
from workbench.identification.rows.outlying_rows import accidents, limits, row_sizes
from workbench.identification.rows.row_selection import placing_rows

GROSS_RATIO = 10.0
"""A row is a gross outlier if its error exceeds the median of the aligned nominal arm by this factor …"""
GROSS_REACH_SHARE = 0.02
"""… and this share of the reach."""
HIDING_RATIO = 4.0
"""The factor where the median itself is beyond this share: such rows have drawn base and tool to them."""
MANY = 0.1
"""Share of the rows from which on those that follow each other are kept."""
MAX_ROUNDS = 3
"""Maximum number of rounds of outlier exclusion."""
MAX_NAMED_ROWS = 15
"""Maximum number of rows that are named."""
REASONS = GROSS, REASON = "gross outlier", "outlier"

Rows = Int[np.ndarray, " k"]


def prepare_without_outliers(
    robot: Robot, data: Dataset, choices: FitChoices, *, reasons: Sequence[str] = REASONS, **options: Any
) -> tuple[Prepared, Rows]:
    """Rows and frames without outliers, and these [indices into data].

    Readings with their own preparation have their own checks.

    Args:
        reasons: Which outliers, of `REASONS`.
        options: Further arguments of `prepare`.
    """
    ready, outlying = prepare(robot, data, choices, **options), list[int]()
    for reason in () if ready.identifiability.is_limited else reasons:
        for _ in range(MAX_ROUNDS):
            found = _gross(ready, robot.reach) if reason == GROSS else _standing_out(ready)
            if not len(found):
                break
            outlying += found.tolist()
            excluded = dict.fromkeys(ready.data.row[found].tolist(), reason)
            choices = replace(choices, exclude={**choices.exclude, **excluded})
            ready = prepare(robot, data, choices, **options)
    return ready, np.array(outlying, np.int64)


def gross_limit(usual: float, reach: float) -> float:
    """Error [m] of gross outliers where the median is this, for an arm of this reach [m]."""
    limit = GROSS_REACH_SHARE * reach
    return max(limit, (GROSS_RATIO if usual < limit else HIDING_RATIO) * usual)


def _gross(ready: Prepared, reach: float) -> Rows:
    """Fitted and held-out rows that are too far from the aligned nominal arm of this reach [m]."""
    nominal = ready.nominal
    limit = gross_limit(1e-3 * nominal.train.position_mm.median, reach)
    both = (nominal.train, ready.problem.data), (nominal.held_out, ready.held_out_data)
    fitted, held = (np.where(_is_tested(ready.problem, d), e.position, 0.0) for e, d in both)
    far = ready.held_out_rows[held > limit] if ready.is_one_file else ready.held_out_rows
    return np.concatenate([ready.train_rows[fitted > limit], far])


def _standing_out(ready: Prepared) -> Rows:
    """Fitted rows that stand out from a robust fit."""
    problem = ready.problem
    if problem.count <= len(problem.names):
        return ready.train_rows[:0]
    out = accidents(problem.with_deviation(MAX_DEVIATION), ready.first_fit[1].x)
    if out.mean() > MANY:  # most of consecutive rows are an event, not accidents
        out &= np.convolve(out, np.ones(5), "same") < 4.0
    return ready.train_rows[out & _is_tested(problem, problem.data)]


def _is_tested(problem: Problem, rows: Dataset) -> Bool[np.ndarray, " rows"]:
    """Whether enough fitted ones place a row's session: else none of them tells which row is wrong."""
    fitted = problem.data
    if fitted.session is None or rows.session is None or not problem.frames.base_per_session:
        return np.ones(len(rows), bool)
    count = Counter(fitted.session.tolist())
    return np.array([count[name] > placing_rows(fitted) for name in rows.session.tolist()], bool)


def suspects(ready: Prepared, fit: Fit, *others: Mapping[str, float]) -> Bool[np.ndarray, " rows"]:
    """Held-out rows that stand out under every arm, compared with a fit's residuals on all rows; others are
    unknowns of further arms by name, the nominal arm is always added."""
    held = ready.held_out_data
    if not len(held):
        return np.zeros(0, bool)
    found = fit.problem.named(fit.x)
    home = ready.with_new_session_bases(fit.arm, held)
    places = instrument_places(home, held, known={**fit.problem.known, **found})
    heavy = [p.name for p in fit.problem.parameters if p.is_inertia and "[" not in p.name]
    weighed = fit.problem.robot.with_values({name: found[name] for name in heavy})
    robot = ready.with_new_session_bases(weighed, held)
    fixed = {name: value for name, value in places.items() if name not in found}
    index = {name: i for i, name in enumerate(found)}
    roots = np.pad(fit.factor.root, ((0, 1), (0, 0)))  # the last one of unknowns that the fit lacks

    def left(data: Dataset, known: Mapping[str, float]) -> Float[np.ndarray, "rows 3"]:
        there = fit.problem.again(robot=robot, data=data, known=fixed, inertia=False)
        root = roots[[index.get(name, -1) for name in there.names]]
        return row_sizes(there, there.at(known), np.zeros(len(data), bool), root)

    after = left(held, found)
    own = row_sizes(fit.problem, fit.x, np.ones(len(fit.problem.data), bool), fit.factor.root)
    maximum = limits(np.concatenate([own, after]))
    out = np.any(after > maximum, axis=1)
    for known in (*others, {}):
        if out.any():
            out[out] = np.any(left(held.take(out), {**places, **known}) > maximum, axis=1)
    return out


@beside("the note on suspects", "")
def suspect_note(rows: list[int], errors: Errors) -> str:
    """Which held-out rows no arm explains, what to do, and the median as a robust alternative to the mean."""
    named = f"row{'s' * (len(rows) > 1)} {first_of(rows, MAX_NAMED_ROWS)}"
    by = remedy(f" (--exclude {','.join(map(str, rows))})", page="")
    text = f"suspects among the held-out rows: no arm explains {named}; to be measured again, or excluded{by}"
    mean, median = errors.text("mean"), errors.text("median")
    return f"{text}. With {named} the mean held-out error is {mean}, the median {median}" if mean else text
