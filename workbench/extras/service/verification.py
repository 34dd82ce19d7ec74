"""Verification of a calibrated arm on poses that its calibration did not use.

With the n attained positions p_j of a command pose p_c, their barycentre p̄, and l_j = ‖p_j − p̄‖:

    AP = ‖p̄ − p_c‖,        RP = l̄ + 3 S_l,        S_l the standard deviation over n − 1

The command pose of a row is where the model expects the tool at the row's joints, so that rows whose joints
differ by a controller's rounding still belong together.

The interval of a mean comes from a bootstrap that draws all visits of a pose together, and whole groups where
the data have them.

Sources: ISO 9283:1998, 7.2; Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 13.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.robot import Robot
from workbench.arm.usable_arm import unobserved_text
from workbench.base.arguments import checked_arguments
from workbench.base.errors import DataError
from workbench.base.threads import one_thread
from workbench.base.types import frozen
from workbench.base.wording import first_of, plural
from workbench.data.accuracy_requirement import Wanted
from workbench.data.arguments import DatasetLike, RobotLike, WantedLike
from workbench.data.dataset import Dataset
from workbench.data.postures import pose_units
from workbench.data.prediction import predict, row_components
from workbench.identification.evaluate import evaluate
from workbench.identification.meaning.as_read import as_read
from workbench.identification.report.results_json import errors_json, reading_json
from workbench.identification.result import Evaluation
from workbench.report.blocks import Block, ResultTable, Sentence, Tone, lines
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.result_display import AbstractShown
from workbench.report.result_fields import DEG, MM, ResultField, ResultFields

SCHEMA = "workbench.verification/1"
USUAL_POSES = 100
"""Poses that practitioners ask of a verification."""
LISTED = 10
"""Repeated poses that a table names one by one, the least accurate first."""
CONFIDENCE = 0.95
DRAWS, PIECE = 2000, 100


@dataclass(frozen=True, eq=False, kw_only=True)
class RepeatedPose:
    """One pose that was visited several times.

    Args:
        rows: Data rows of the visits.
        accuracy: AP [m].
        repeatability: RP [m].
    """

    rows: Int[np.ndarray, " visits"]
    accuracy: float
    repeatability: float

    @classmethod
    def of(cls, rows: Int[np.ndarray, " n"], off: Float[np.ndarray, "n 3"]) -> "RepeatedPose":
        """AP and RP from deviations attained − command of at least two visits [m]."""
        length = np.linalg.norm(off - off.mean(0), axis=1)
        repeatability = float(length.mean() + 3.0 * length.std(ddof=1))
        accuracy = float(np.linalg.norm(off.mean(0)))
        return cls(rows=frozen(rows), accuracy=accuracy, repeatability=repeatability)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Verification(AbstractShown):
    """What fresh poses show of a calibrated arm.

    Args:
        evaluation: The arm and its errors on the fresh rows.
        position: Interval of the mean position error [m].
        rotation: Interval of the mean orientation error [rad]; None where none was measured.
        repeated: AP and RP of poses that were visited several times.
        pose: Which pose each row visits, from 0.
        wanted: The requirement; None: nothing is judged.
        warnings: What weakens the statement, one sentence each.
    """

    evaluation: Evaluation
    position: tuple[float, float]
    rotation: tuple[float, float] | None
    repeated: tuple[RepeatedPose, ...]
    pose: Int[np.ndarray, " rows"]
    wanted: Wanted | None
    warnings: tuple[str, ...]

    @cached_property
    def within(self) -> Bool[np.ndarray, " rows"]:
        """Rows that keep what was wanted; all of them where nothing was."""
        rows = self.evaluation.errors
        if self.wanted is None:
            return np.ones(len(self.pose), bool)
        kept = self.wanted.within_by_norms(rows.position, rows.rotation)
        axes = row_components(self.evaluation.robot, self.evaluation.data)
        return np.where(axes.has_position & self.wanted.per_axis, self.wanted.within(axes), kept)

    @property
    def passed(self) -> bool | None:
        """Whether every fresh row is of this arm and keeps what was wanted; None where nothing was."""
        return None if self.wanted is None else bool(self.within.all() and not self.evaluation.foreign)

    @property
    def poses(self) -> int:
        """How many different poses there are."""
        return int(self.pose.max()) + 1

    @property
    def verdict(self) -> str:
        if self.evaluation.foreign:
            return f"No verdict: {self.evaluation.foreign}."
        if self.wanted is None:
            return "No verdict: set a required error (such as --wanted 0.3mm)."
        rows = f"{plural(len(self.pose), 'measurement')} of {plural(self.poses, 'fresh pose')}"
        if self.passed:
            return f"Passed: all {rows} are within {self.wanted.text}."
        failed = self.evaluation.data.row[~self.within].tolist()
        which = f"row{'s' * (len(failed) > 1)} {first_of(failed, LISTED)}"
        return f"Failed: {len(failed)} of {rows} beyond {self.wanted.text}: {which}."

    def blocks(self) -> Iterator[Block]:
        errors, name = self.evaluation.errors, self.evaluation.robot.name
        kinds = (
            ("position [mm]", errors.position_mm, self.position, MM),
            ("orientation [°]", errors.orientation_deg, self.rotation, DEG),
        )
        rows = [
            (kind, short(own.mean), " … ".join(map(short, unit.of(ends))), short(own.rms), short(own.max))
            for kind, own, ends, unit in kinds
            if own is not None and ends is not None
        ]
        title = f"{name}: {len(self.pose)} rows of {self.poses} fresh poses"
        yield ResultTable(title, ("error", "mean", "95 %", "rms", "max"), rows)
        if worst := sorted(self.repeated, key=lambda pose: -pose.accuracy):
            yield REPEATED.table(f"ISO 9283, {plural(len(worst), 'repeated pose')}", worst[:LISTED])
        yield Sentence(self.verdict, tone={True: Tone.GOOD, False: Tone.BAD, None: Tone.STRONG}[self.passed])
        yield from lines("warning", self.warnings)
        yield from lines("note", self.evaluation.notes)

    def json(self) -> Json:
        return document(
            SCHEMA,
            robot=self.evaluation.robot.name,
            **reading_json(self.evaluation.data, self.evaluation.robot),
            passed=self.passed,
            verdict=self.verdict,
            wanted=self.wanted and self.wanted.json(),
            rows=len(self.pose),
            poses=self.poses,
            errors=errors_json(self.evaluation.errors),
            confidence=CONFIDENCE,
            intervals={
                "position_mm": {"mean": MM.of(self.position)},
                "orientation_deg": self.rotation and {"mean": DEG.of(self.rotation)},
            },
            iso9283=REPEATED.each(self.repeated),
            failed_rows=self.evaluation.data.row[~self.within],
            warnings=self.warnings,
            notes=self.evaluation.notes,
        )


REPEATED = ResultFields(
    ResultField("rows", title="first row", text=lambda rows: str(rows[0])),
    ResultField("visits", of=lambda pose: len(pose.rows), title="visits"),
    ResultField("AP", MM, of="accuracy", title="AP"),
    ResultField("RP", MM, of="repeatability", title="RP"),
)
"""Of a `RepeatedPose`."""


@checked_arguments()
@one_thread()
def verify(
    robot: RobotLike,
    data: DatasetLike,
    *,
    wanted: WantedLike | None = None,
    fit_frames: bool = False,
    reading: str = "auto",
) -> Verification:
    """Errors of a calibrated arm on fresh poses, with intervals; AP and RP where poses repeat.

    Args:
        robot: The calibrated arm.
        data: Measurements of fresh poses; rows whose joints the calibration used by its record in the robot's
            file, rows that the file excludes, and rows without a measured position are left out.
        wanted: What every row has to keep; a number is a position error [m].
        fit_frames: Whether base and tool are fitted first, as of `evaluate`: the instrument was moved.
        reading: What rows mean that fit far better in another reading, as in `FitChoices`.

    Raises:
        DataError: no fresh row is left, or data that contradict the robot beyond doubt.
    """
    robot, data, rival = as_read(robot, data, reading, keeps_arm=True, takes_rival=True)
    robot.check_joints(data.q, data.source)
    data, warnings = _fresh(robot, data)
    found = evaluate(robot, data, fit_frames=fit_frames, reading="given")
    seen = np.isfinite(found.errors.position)
    if not seen.any():
        raise DataError(f"{data.source}: there are no positions to verify (x[m], markers, distance, contact)")
    of_arm = rival or found.foreign
    found = replace(found, data=found.data.take(seen), errors=found.errors.take(seen), foreign=of_arm)
    pose, group = pose_units(replace(found.data, group=None)), pose_units(found.data)
    rng = np.random.default_rng(0)
    turned = np.isfinite(found.errors.rotation)
    warnings += (*(text for text in found.warnings if text != found.foreign), *unobserved_text(robot))
    if not seen.all():
        warnings.append(f"{seen.sum()} of {len(seen)} rows have a measured position; the others are ignored")
    if fit_frames or data.distance is not None or data.contact is not None:
        fitted = "base and tool" if fit_frames else "positions of anchors and contacts"
        warnings.append(f"{fitted} were fitted to these rows, which reduces the errors")
    if (poses := len(np.unique(pose))) < USUAL_POSES:
        warnings.append(f"{plural(poses, 'different pose')}: {USUAL_POSES} or more are usual")
    if wanted is not None and wanted.rotation is not None and not turned.all():
        rows = f"{turned.sum()} of {plural(len(turned), 'row')}"
        warnings.append(f"{rows} have a measured orientation; its limit is evaluated on those alone")
        wanted = wanted if turned.any() else replace(wanted, rotation=None)
    return Verification(
        evaluation=found,
        position=mean_interval(found.errors.position, group, rng),
        rotation=mean_interval(found.errors.rotation[turned], group[turned], rng) if turned.any() else None,
        repeated=_repeated(found, pose),
        pose=pose,
        wanted=wanted,
        warnings=tuple(warnings),
    )


def _fresh(robot: Robot, data: Dataset) -> tuple[Dataset, list[str]]:
    """Rows that the calibration did not use and sentences on the others."""
    data = data.take(data.included)
    if robot.calibration is None:
        return data, ["the robot's file records no poses of its calibration; measure others"]
    if (old := robot.calibration.used(data.q)).any() and old.all():
        used = "every row was used for the calibration; measure other poses to verify it"
        raise DataError(f"{data.source}: {used}")
    left = f"{plural(int(old.sum()), 'row')} left out: the calibration used the same joints"
    return data.take(~old), [left] * bool(old.any())


def _repeated(found: Evaluation, pose: Int[np.ndarray, " rows"]) -> tuple[RepeatedPose, ...]:
    """AP and RP of every pose with two or more measured positions, in the order of the first visit."""
    if (attained := found.data.position) is None:
        return ()
    off = attained - predict(found.robot, found.data)[:, :3, 3]
    seen = np.isfinite(off).all(1)
    visits = (np.flatnonzero(seen & (pose == label)) for label in np.unique(pose))
    return tuple(RepeatedPose.of(found.data.row[rows], off[rows]) for rows in visits if len(rows) > 1)


def mean_interval(
    errors: Float[np.ndarray, " rows"], group: np.ndarray, rng: np.random.Generator
) -> tuple[float, float]:
    """Where the mean of all errors like these lies, low and high.

    Args:
        group: Label of what is drawn together: the pose that a row visits, or the data's own groups.
    """
    label = np.unique(group, return_inverse=True)[1]
    sums = np.stack([np.bincount(label), np.bincount(label, errors)], 1)
    even = np.full(len(sums), 1.0 / len(sums))
    pieces = [rng.multinomial(len(sums), even, PIECE) @ sums for _ in range(DRAWS // PIECE)]
    rows, total = np.concatenate(pieces).T
    low, high = np.quantile(total / rows, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE])
    return float(low), float(high)
