"""Evaluation: errors of a given model on data, without fitting."""

from dataclasses import replace

import workbench.identification.report.document  # noqa: F401 how results are shown
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.measuring_order import with_drivers
from workbench.data.plausibility import checked
from workbench.identification.errors.row_errors import row_errors
from workbench.identification.frames import choose_frames, warnings_of
from workbench.identification.meaning.as_read import as_read
from workbench.identification.result import Evaluation


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
    if fit_frames:
        held = {k: f for k in ("base", "tool") if (f := getattr(robot, k)).free is Freedom.FIXED}
        arm = robot.with_frames(**{k: replace(f, free=Freedom.AUTO) for k, f in held.items()})
        choice = choose_frames(arm, used, free=())
        robot, notes = choice.robot, [*notes, *choice.notes]
        fitted = len(choice.freedom.base) + len(choice.freedom.tool)
    errors = row_errors(robot, used)
    return Evaluation(robot, used, errors, tuple(notes), warnings_of(robot, used, errors, fitted))
