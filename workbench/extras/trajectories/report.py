"""Planned and corrected trajectories as tables and JSON (`workbench.path/1`, `…compensation/1`)."""

import numpy as np

from workbench.arm.joint_units import shown_joints, shown_units
from workbench.arm.statics.moments import JointMoments
from workbench.base.wording import plural
from workbench.extras.trajectories.compensation import ACCEPTED_ERROR, Compensation, PathErrors
from workbench.extras.trajectories.planning import Planned
from workbench.identification.errors.row_errors import Spread
from workbench.report.blocks import Block, ResultTable, headed
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.result_display import blocks_of

LOADS = ("joint", "minimum", "maximum", "max speed [/s]", "torque [N m]", "moment across axis [N m]")


def path_json(planned: Planned, moments: JointMoments | None) -> Json:
    """The trajectory as plain data, SI; moments are null if the arm has no masses."""
    return document(
        "workbench.path/1",
        robot=planned.robot.name,
        task=planned.task.name.lower(),
        axis=planned.axis,
        time=planned.time,
        q=planned.q,
        velocity=planned.motion.velocity,
        acceleration=planned.motion.acceleration,
        torque=None if moments is None else moments.about,
        moment_x=None if moments is None else moments.across[:, :, 0],
        moment_y=None if moments is None else moments.across[:, :, 1],
        notes=planned.notes,
    )


def path_blocks(planned: Planned, moments: JointMoments | None) -> list[Block]:
    """Range, maximum speed and maximum loads of every joint, and decisions."""
    speed = np.abs(np.asarray(planned.motion.velocity)).max(axis=0)
    loads = np.full((planned.robot.dof, 2), np.nan)
    if moments is not None:
        loads = np.column_stack([np.abs(moments.about).max(0), moments.tipping.max(0)])
    sizes = shown_joints(planned.robot, np.stack([planned.q.min(0), planned.q.max(0), speed])).T
    rows = [
        (f"{j}", *(f"{v:.2f}{unit}" for v in size), *map(short, load))
        for j, (size, unit, load) in enumerate(zip(sizes, shown_units(planned.robot), loads, strict=True), 1)
    ]
    head = f"{planned.robot.name}: {plural(len(planned.time), 'row')}, {planned.time[-1]:g} s"
    return headed(head, ResultTable("", LOADS, rows), notes=planned.notes)


def compensation_json(found: Compensation) -> Json:
    """The result as plain data; rows count from 0. Errors are predicted by the calibrated model, excluding
    its own error (`model_error` [m, rad], from held-out rows).
    """
    commanded, time = found.commanded, found.motion.time
    columns = {
        "row": np.arange(len(found.q)),
        "time": [None] * len(found.q) if time is None else time,
        "before_mm": 1e3 * found.before.position,
        "after_mm": 1e3 * found.after.position,
        "kept": found.kept,
    }
    return document(
        "workbench.compensation/1",
        robot=commanded.calibrated.name,
        method=found.method,
        task=commanded.task.name.lower(),
        effects=[e.name for e in commanded.calibrated.effects],
        before=_errors(found.before),
        after=_errors(found.after),
        model_error=None if commanded.expected is None else list(commanded.expected),
        largest_correction=np.abs(found.q - commanded.q).max(0),
        greatest_speed=found.speed,
        rows=[dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
        notes=found.notes,
    )


@blocks_of.register
def compensation_blocks(found: Compensation) -> list[Block]:
    """Predicted errors before and after, and decisions."""
    rows = [_cells("as commanded", found.before)]
    if found.after.position.max() > ACCEPTED_ERROR:
        rows.append(_cells(f"corrected ({found.method})", found.after))
    own = found.commanded.expected
    mean, angle = ("–", "–") if own is None else (short(1e3 * own.position), short(np.rad2deg(own.rotation)))
    rows.append(("corrected (model error on held-out rows)", mean, "–", angle, "–"))
    headings = ("predicted error", "mean [mm]", "max [mm]", "mean [°]", "max [°]")
    head = f"{found.commanded.calibrated.name}: {plural(len(found.q), 'row')}"
    return headed(head, ResultTable("", headings, rows), notes=found.notes)


def _cells(what: str, errors: PathErrors) -> tuple[str, ...]:
    spreads = Spread.of(1e3 * errors.position), Spread.of(np.rad2deg(errors.rotation))
    return what, *(short(size) for spread in spreads for size in (spread.mean, spread.max))


def _errors(errors: PathErrors) -> Json:
    return {
        "position_mm": Spread.of(1e3 * errors.position)._asdict(),
        "orientation_deg": Spread.of(np.rad2deg(errors.rotation))._asdict(),
    }
