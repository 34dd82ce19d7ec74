"""Evaluation: errors of a given model on data, without fitting."""

from dataclasses import replace

import numpy as np

import workbench.identification.report.document  # noqa: F401 how results are shown
from workbench.arm.robot import Robot
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.dataset import Dataset
from workbench.data.measuring_order import with_drivers
from workbench.data.plausibility import checked
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.frames import FrameChoice, choose_frames, warnings_of
from workbench.identification.meaning.as_read import as_read
from workbench.identification.result import Evaluation, Outlier, computed_text, set_apart
from workbench.identification.rows.excluded_outliers import gross_limit
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
    notes, fitted, said = [*data.notes, *robot.extrapolation_warnings(used.q, used.row)], 0, list[str]()
    if fit_frames:
        held = {k: f for k in ("base", "tool") if (f := getattr(robot, k)).free is Freedom.FIXED}
        arm = robot.with_frames(**{k: replace(f, free=Freedom.AUTO) for k, f in held.items()})
        choice, kept = _with_frames(arm, used)
        robot, notes = choice.robot, [*notes, *choice.notes]
        fitted = len(choice.freedom.base) + len(choice.freedom.tool)
        if len(kept) < len(used):
            off, far = row_errors(robot, used), ~np.isin(used.row, kept.row)
            columns = (v[far].tolist() for v in (used.row, off.position, off.rotation, off.position))
            said, used = [set_apart(tuple(map(Outlier, *columns)), off.take(~far))], kept
    errors = row_errors(robot, used)
    said += filter(None, [computed_text(robot, errors, data) if robot.calibration is None else ""])
    return Evaluation(robot, used, errors, tuple(notes), (*said, *warnings_of(robot, used, errors, fitted)))


def _with_frames(arm: Robot, data: Dataset) -> tuple[FrameChoice, Dataset]:
    """The arm with the base and tool that fit its rows best, without gross outliers, and these rows."""
    choice = choose_frames(arm, data, free=())
    errors = row_errors(choice.robot, data)
    far = errors.position > gross_limit(1e-3 * errors.position_mm.median, arm.reach)
    return _with_frames(arm, data.take(~far)) if 0.0 < far.mean() < MAX_SHARE else (choice, data)
