"""Evaluation: errors of a given model on data, without fitting."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

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
from workbench.identification.errors.row_errors import Errors, instrument_places, row_errors
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
    errors, far = row_errors(robot, used), np.zeros(len(used), bool)
    if fit_frames:
        held = {k: f for k in ("base", "tool") if (f := getattr(robot, k)).free is Freedom.FIXED}
        arm = robot.with_frames(**{k: replace(f, free=Freedom.AUTO) for k, f in held.items()})
        choice, errors, far = _with_frames(arm, used, far)
        robot, notes = choice.robot, [*notes, *choice.notes]
        fitted = len(choice.freedom.base) + len(choice.freedom.tool)
    others = errors.take(~far)
    if far.any():
        columns = (v[far].tolist() for v in (used.row, errors.position, errors.rotation, errors.position))
        said.append(set_apart(tuple(map(Outlier, *columns)), others, "took no part in base and tool"))
    said += warnings_of(robot, used.take(~far), others, fitted)
    if not said and robot.calibration is None:
        said += filter(None, [computed_text(robot, others, data)])
    return Evaluation(robot, used, errors, tuple(notes), tuple(said))


def _with_frames(
    arm: Robot, data: Dataset, far: Bool[np.ndarray, " rows"]
) -> tuple[FrameChoice, Errors, Bool[np.ndarray, " rows"]]:
    """The arm with the best base and tool, errors of all rows, and gross outliers, which count only there."""
    some = data.take(~far)
    choice = choose_frames(arm, some, free=())
    errors = row_errors(choice.robot, data, known=instrument_places(choice.robot, some))
    more = far | (errors.position > gross_limit(1e-3 * errors.take(~far).position_mm.median, arm.reach))
    is_last = (more == far).all() or more.mean() >= MAX_SHARE
    return (choice, errors, far) if is_last else _with_frames(arm, data, more)
