"""Verification of a calibrated arm on poses that its calibration did not use."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

import workbench.extras.service.verification.report  # noqa: F401 how results are shown
from workbench.arm.robot import Robot
from workbench.arm.usable_arm import unobserved_text
from workbench.base.arguments import Angle, Like, Seed, checked_arguments
from workbench.base.errors import DataError, OptionError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.data.arguments import DatasetLike, RobotLike, WantedLike
from workbench.data.dataset import Dataset
from workbench.extras.service.verification.intervals import Bounds
from workbench.extras.service.verification.iso9283 import SAME_POSE, cycle_text, pose_labels, repeated_poses
from workbench.extras.service.verification.result import Verification
from workbench.identification.evaluate import evaluate
from workbench.identification.result import Evaluation

USUAL_POSES = 100
"""Poses that practitioners ask of a verification."""


@checked_arguments()
@one_thread()
def verify(
    robot: RobotLike,
    data: DatasetLike,
    *,
    wanted: WantedLike | float | None = None,
    used: DatasetLike | None = None,
    same: Like[Angle] = SAME_POSE,
    fit_frames: bool = False,
    facts: dict[str, str] | None = None,
    seed: Seed = 0,
) -> Verification:
    """Errors of a calibrated arm on fresh poses, with intervals; AP and RP where poses repeat.

    Rows whose joints the calibration used are left out: those that the robot's file remembers, and those of
    `used`.

    Args:
        robot: The calibrated arm.
        data: Measurements of fresh poses; rows that the file excludes, and rows without a measured position,
            are left out.
        wanted: What every row has to keep; a number is a position error [m].
        used: Measurements of the calibration.
        same: Maximum difference of any joint between visits of one pose [rad or m].
        fit_frames: Whether base and tool are fitted first, where they are free: the instrument was moved.
        facts: What a certificate says beside the data.
        seed: Of the bootstrap.

    Raises:
        DataError: no fresh row is left, or data that contradict the robot beyond doubt.
    """
    robot.check_joints(data.q, data.source)
    if not same > 0.0:
        raise OptionError(f"same must be positive, got {same:g}", option="same", found=same)
    if not len(data):
        raise DataError(f"{data.source or 'the measurements'}: no rows to verify with")
    fresh, warnings = _fresh(robot, data, used, same)
    warnings += unobserved_text(robot)
    if data.distance is not None or data.contact is not None:
        warnings.append(
            "positions of anchors and contacts were fitted to these rows, which reduces the errors"
        )
    found = evaluate(robot, data.take(fresh), fit_frames=fit_frames)
    found, unmeasured = _positions_of(found)
    warnings += unmeasured
    rng = np.random.default_rng(seed)
    turned = np.isfinite(found.rows.rotation)
    pose = pose_labels(found.data, same=same)
    group = pose if found.data.group is None else found.data.group
    repeated = repeated_poses(found.robot, found.data, pose)
    poses = int(pose.max()) + 1
    if poses < USUAL_POSES:
        warnings.append(f"{plural(poses, 'different pose')}: {USUAL_POSES} or more are usual")
    if fit_frames:
        warnings.append("base and tool were fitted to these rows, which reduces the errors")
    wanted = Wanted(position=wanted) if isinstance(wanted, int | float) else wanted
    if wanted is not None and wanted.rotation is not None and not turned.all():
        warnings.append(
            f"{int(turned.sum())} of {plural(len(turned), 'row')} have a measured orientation: the limit of "
            f"{np.rad2deg(wanted.rotation):.2g}° is evaluated on {'those' if turned.any() else 'none'}"
        )
    return Verification(
        evaluation=replace(found, notes=(*found.notes, cycle_text(repeated))),
        position=Bounds.of(found.rows.position, pose, group, rng),
        rotation=Bounds.of(found.rows.rotation[turned], pose[turned], group[turned], rng)
        if turned.any()
        else None,
        repeated=repeated,
        pose=frozen(pose),
        same=same,
        wanted=wanted,
        facts=dict(facts or {}),
        warnings=tuple(warnings),
    )


def _fresh(
    robot: Robot, data: Dataset, used: Dataset | None, same: float
) -> tuple[Bool[np.ndarray, " rows"], list[str]]:
    """Rows that the calibration did not use, and notes on the others."""
    from scipy.spatial import cKDTree

    old = np.zeros(len(data), bool)
    if robot.calibration is not None:
        old |= robot.calibration.used(data.q)
    if used is not None:
        robot.check_joints(used.q, used.source)
        old |= np.isfinite(cKDTree(used.q).query(data.q, distance_upper_bound=same, p=np.inf)[0])
    if old[data.included].all() and old.any():
        raise DataError(
            f"{data.source}: every row was used for the calibration; measure other poses to verify it"
        )
    warnings = []
    if old.any():
        warnings.append(f"{plural(int(old.sum()), 'row')} left out: the calibration used the same joints")
    elif robot.calibration is None and used is None:
        warnings.append(
            "the robot's file does not list the poses of its calibration: give them (--used) to make sure "
            "that none of these is among them"
        )
    copies = _copies(data, data.included & ~old)
    if copies.any():
        warnings.append(f"{plural(int(copies.sum()), 'duplicate row')} ignored")
    return ~(old | copies), warnings


def _copies(data: Dataset, used: Bool[np.ndarray, " rows"]) -> Bool[np.ndarray, " rows"]:
    """Rows in use that repeat an earlier one of them in joints, time and the position measured."""
    out = np.zeros(len(data), bool)
    if data.position is None:
        return out
    seen = [data.q, *(v for v in (data.position, data.rotation, data.time) if v is not None)]
    table = np.column_stack([np.asarray(v, float).reshape(len(data), -1) for v in seen])
    rows = np.flatnonzero(used & np.isfinite(data.position).all(1))
    once = np.unique(np.where(np.isnan(table), np.inf, table)[rows], axis=0, return_index=True)[1]
    out[np.delete(rows, once)] = True
    return out


def _positions_of(found: Evaluation) -> tuple[Evaluation, list[str]]:
    """The rows with a measured position, and a sentence where others were left out."""
    seen = np.isfinite(found.rows.position)
    if not seen.any():
        raise DataError(
            f"{found.data.source}: there are no positions to verify (x[m], markers, distance, contact)"
        )
    if seen.all():
        return found, []
    count = f"{int(seen.sum())} of {plural(len(seen), 'row')}"
    note = f"{count} have a measured position; the others are not evaluated"
    return replace(found, data=found.data.take(seen), rows=found.rows.take(seen)), [note]
