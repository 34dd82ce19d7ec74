"""Evaluation: errors of a given model on data, without fitting."""

from dataclasses import replace

import numpy as np

import workbench.identification.report.document  # noqa: F401 how results are shown
from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.base.wording import first_of, in_mm
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import with_drivers
from workbench.data.plausibility import checked
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.frames import FrameChoice, choose_frames, warnings_of
from workbench.identification.meaning.as_read import as_read
from workbench.identification.result import Evaluation
from workbench.identification.rows.excluded_outliers import MAX_NAMED_ROWS, MAX_ROUNDS, gross_limit
from workbench.identification.rows.outlying_rows import MAX_SHARE


@checked_arguments()
@one_thread()
def evaluate(
    robot: RobotLike, data: DatasetLike, *, fit_frames: bool = False, reading: str = "auto"
) -> Evaluation:
    """Errors of a given model; nothing is fitted, or only base and tool.

    Args:
        robot: A nominal or calibrated arm.
        data: Measurements; rows that the file excludes are left out.
        fit_frames: Whether base and tool are fitted; those that the file holds if the rows need others.
        reading: What rows mean that fit far better in another reading, as in `FitChoices`.
    """
    robot, data = as_read(robot, data, reading, notes_rival=True)
    data = with_drivers(robot, checked(robot, data))
    used = data.take(data.included)
    if not len(used):
        raise DataError(f"{data.source}: all rows are excluded; there is nothing to evaluate")
    notes, fitted = [*data.notes, *robot.extrapolation_warnings(used.q, used.row)], 0
    far = list[str]()
    if fit_frames:
        held = {k: f for k in ("base", "tool") if (f := getattr(robot, k)).free is Freedom.FIXED}
        arm = robot.with_frames(**{k: replace(f, free=Freedom.AUTO) for k, f in held.items()})
        choice, used, far = _with_frames(arm, used)
        robot, notes = choice.robot, [*notes, *choice.notes]
        fitted = len(choice.freedom.base) + len(choice.freedom.tool)
    errors = row_errors(robot, used)
    return Evaluation(robot, used, errors, tuple(notes), (*far, *warnings_of(robot, used, errors, fitted)))


def _with_frames(arm: Robot, data: Dataset) -> tuple[FrameChoice, Dataset, list[str]]:
    """The arm with the base and tool that fit its rows, these without gross outliers, and which those are."""
    choice, gross = choose_frames(arm, data, free=()), np.zeros(len(data), bool)
    for _ in range(MAX_ROUNDS):
        errors = row_errors(choice.robot, data)
        new = errors.position > gross_limit(1e-3 * errors.take(~gross).position_mm.median, arm.reach)
        if (new == gross).all() or new.mean() > MAX_SHARE:
            break
        gross = new
        choice = choose_frames(arm, data.take(~gross), free=())
    if not gross.any():
        return choice, data, []
    off = row_errors(choice.robot, data).position
    each = [f"{data.row[k]} ({in_mm(off[k])} off)" for k in np.flatnonzero(gross)]
    which = f"{'row' if len(each) == 1 else 'rows'} {first_of(each, MAX_NAMED_ROWS)} left out"
    said = f"{which}: base and tool are fitted to the others; measure again, or correct the file"
    return choice, data.take(~gross), [said]
