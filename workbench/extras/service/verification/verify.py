"""Verification of a calibrated arm on poses that its calibration did not use."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.robot import Robot
from workbench.arm.usable import unobserved_text
from workbench.base.argument_checks import Like, Seed
from workbench.base.errors import DataError, OptionError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.data.dataset import Dataset
from workbench.data.prediction import RowComponents, row_components
from workbench.extras.service.verification.intervals import Bounds, minimum_share, worst_of
from workbench.extras.service.verification.iso9283 import (
    SAME_POSE,
    RepeatedPose,
    cycle_text,
    pose_labels,
    repeated_poses,
)
from workbench.identification.evaluate import evaluate
from workbench.identification.result import Evaluation
from workbench.plate.argument_types import checked_arguments
from workbench.report.result_display import AbstractShown, figures_of, tables_of

USUAL_POSES = 100
"""Poses that practitioners ask of a verification."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Verification(AbstractShown):
    """What fresh poses show of a calibrated arm.

    Args:
        evaluation: The arm and its errors on the fresh rows.
        position: Intervals of the position error [m].
        rotation: Intervals of the orientation error [rad]; None where none was measured.
        repeated: AP and RP of poses that were visited several times.
        pose: Which pose each row visits, from 0.
        same: Maximum difference of any joint between visits of one pose [rad or m].
        wanted: The requirement; None: nothing is judged.
        facts: What the certificate says beside the data, such as instrument and serial number.
        warnings: What weakens the statement, one sentence each.
    """

    summary = tables_of("workbench.extras.service.verification.results:verification_tables")
    plot = figures_of("workbench.extras.service.verification.plots:error_figure")

    evaluation: Evaluation
    position: Bounds
    rotation: Bounds | None
    repeated: tuple[RepeatedPose, ...]
    pose: Int[np.ndarray, " rows"]
    same: float = SAME_POSE
    wanted: Wanted | None = None
    facts: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def robot(self) -> Robot:
        return self.evaluation.robot

    @property
    def data(self) -> Dataset:
        return self.evaluation.data

    @cached_property
    def within(self) -> Bool[np.ndarray, " rows"]:
        """Rows that keep what was wanted; all of them where nothing was."""
        rows = self.evaluation.rows
        if self.wanted is None:
            return np.ones(len(rows.position), bool)
        kept = self.wanted.within_by_norms(rows.position, rows.rotation)
        if not self.wanted.per_axis:
            return kept
        return np.where(self._axes.has_position, self.wanted.within(self._axes), kept)

    @cached_property
    def judged_positions(self) -> Float[np.ndarray, " rows"]:
        """What is held against the limit [m]: the largest entry of each position error where all axes have to
        keep it and were measured, else the length."""
        lengths = self.evaluation.rows.position
        if self.wanted is None or not self.wanted.per_axis:
            return lengths
        return np.where(self._axes.has_position, np.abs(self._axes.position).max(axis=1), lengths)

    @cached_property
    def _axes(self) -> RowComponents:
        return row_components(self.robot, self.data)

    @property
    def passed(self) -> bool | None:
        """Whether every fresh row keeps what was wanted; None where nothing was."""
        return None if self.wanted is None else bool(self.within.all())

    @property
    def poses(self) -> int:
        """How many different poses there are."""
        return int(self.pose.max()) + 1

    @property
    def minimum_share(self) -> float:
        """Share of all poses like these that keep it, at least, with 95 % confidence.

        Poses without a measured orientation don't count where some have one and a limit is set on it.
        """
        whole = self._has_rotation if self._judges_rotation else np.ones(len(self.within), bool)
        failed = worst_of((~self.within[whole]).astype(float), self.pose[whole])
        return minimum_share(int((failed == 0.0).sum()), len(failed))

    @property
    def _has_rotation(self) -> Bool[np.ndarray, " rows"]:
        return np.isfinite(self.evaluation.rows.rotation)

    @property
    def _judges_rotation(self) -> bool:
        return self.wanted is not None and self.wanted.rotation is not None and bool(self._has_rotation.any())

    @property
    def verdict(self) -> str:
        if self.wanted is None:
            return "No verdict: set a required error (--wanted)."
        rows = f"{plural(len(self.within), 'measurement')} of {plural(self.poses, 'fresh pose')}"
        limit = self.wanted.text if self._judges_rotation else self.wanted.position_text
        if self.passed:
            return (
                f"Passed: all {rows} are within {limit}; with 95 % confidence so are at least "
                f"{100.0 * self.minimum_share:.1f} % of all poses like these."
            )
        failed = int((~self.within).sum())
        return f"Failed: {failed} of {rows} {'is' if failed == 1 else 'are'} beyond {limit}."


@checked_arguments()
@one_thread()
def verify(
    robot: Like[Robot],
    data: Like[Dataset],
    *,
    wanted: Like[Wanted] | float | None = None,
    used: Like[Dataset] | None = None,
    same: float = SAME_POSE,
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
        raise OptionError(f"same must be positive, got {same:g}")
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
