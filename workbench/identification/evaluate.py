"""Evaluation: errors of a given model on data, without fitting."""

from dataclasses import replace

import numpy as np

import workbench.identification.report.document  # noqa: F401 how results are shown
from workbench.base.arguments import Like, checked_arguments
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import Freedom
from workbench.base.wording import listed
from workbench.data.arguments import DatasetLike, RobotLike
from workbench.data.measuring_order import with_drivers
from workbench.data.plausibility import checked
from workbench.identification.errors.row_errors import UNKNOWN, instrument_places, row_errors
from workbench.identification.fit_choices import Excluded
from workbench.identification.frames import choose_frames, doubt_of
from workbench.identification.meaning.as_read import as_read
from workbench.identification.result import Evaluation, Outlier, computed_text, set_apart
from workbench.identification.rows.excluded_outliers import gross_limit
from workbench.identification.rows.outlying_rows import MAX_ACCIDENTS, limits


@checked_arguments()
@one_thread()
def evaluate(
    robot: RobotLike,
    data: DatasetLike,
    *,
    fit_frames: bool = False,
    reading: str = "auto",
    exclude: Like[Excluded] | None = None,
) -> Evaluation:
    """Errors of a given model; nothing is fitted, or only base and tool.

    Args:
        robot: A nominal or calibrated arm.
        data: Measurements; rows that the file excludes are left out.
        fit_frames: Whether base and tool are fitted; those that the file holds if the rows need others.
        reading: What rows mean that fit far better in another reading, as in `FitChoices`.
        exclude: Further rows to leave out, with the reason.
    """
    robot, data, rival = as_read(robot, data, reading, exclude=exclude, takes_rival=True)
    data = with_drivers(robot, checked(robot, data))
    used = data.take(data.included)
    if not len(used):
        raise DataError(f"{data.source}: all rows are excluded; there is nothing to evaluate")
    notes, arm, said = (*data.notes, *robot.extrapolation_warnings(used.q, used.row)), robot, list[str]()
    if fit_frames:
        held = {k: f for k in ("base", "tool") if (f := getattr(robot, k)).free is Freedom.FIXED}
        arm = robot.with_frames(**{k: replace(f, free=Freedom.AUTO) for k, f in held.items()})
    choice, fitted, far = None, 0, np.zeros(len(used), bool)
    errors = UNKNOWN if fit_frames else row_errors(robot, used)
    while True:  # until no outliers take part in base and tool
        if fit_frames:
            choice = choose_frames(arm, some := used.take(~far), free=())
            errors = row_errors(choice.robot, used, known=instrument_places(choice.robot, some))
        others = errors.take(~far)
        sizes = np.nan_to_num([errors.position, errors.rotation, errors.tilt]).T
        gross = errors.position > gross_limit(1e-3 * others.position_mm.median, robot.reach)
        more = far | gross | (sizes > limits(sizes)).any(1)
        if (more == far).all() or more.mean() >= MAX_ACCIDENTS:
            break
        far = more
    if choice is not None:
        robot, notes = choice.robot, (*notes, *choice.notes)
        fitted = len(choice.freedom.base) + len(choice.freedom.tool)
    parts = {name: far[used.in_session(name)] for name in used.sessions}
    moved = [name for name, own in parts.items() if own.sum() > 2 and own.mean() > MAX_ACCIDENTS]
    own = far & np.any([used.in_session(name) for name in moved], axis=0)
    if moved:
        off, usual = errors.take(own).text("median"), others.text("median")
        do = "" if fit_frames else "; fit them: --frames fit"
        said.append(f"session {listed(moved)}: base or tool moved, {off} off (the others: {usual}){do}")
    if (lone := far & ~own).any():
        columns = (v[lone].tolist() for v in (used.row, errors.position, errors.rotation, errors.position))
        how = "took no part in base and tool" if fit_frames else "included in these errors"
        said.append(set_apart(tuple(map(Outlier, *columns)), others, used, how))
    doubt, is_foreign = doubt_of(robot, used.take(~far), others, fitted)
    is_nominal = robot.calibration is None and not said and not doubt and not rival
    said += filter(None, [doubt, rival, computed_text(robot, others, data) if is_nominal else ""])
    return Evaluation(robot, used, errors, notes, tuple(said), rival or doubt * is_foreign)
