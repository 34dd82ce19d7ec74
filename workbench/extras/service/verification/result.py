"""What fresh poses show of a calibrated arm."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.robot import Robot
from workbench.base.wording import plural
from workbench.data.accuracy_requirement import Wanted
from workbench.data.dataset import Dataset
from workbench.data.prediction import RowComponents, row_components
from workbench.extras.service.verification.intervals import Bounds, minimum_share, worst_of
from workbench.extras.service.verification.iso9283 import SAME_POSE, RepeatedPose
from workbench.identification.result import Evaluation
from workbench.report.result_display import AbstractPlotted


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Verification(AbstractPlotted):
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
