"""The result of a diagnosis."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from jaxtyping import Float

from workbench.arm.effects import AbstractEffect
from workbench.arm.effects.events import AbstractEvent
from workbench.arm.robot import Robot
from workbench.base.advice import beside
from workbench.data.dataset import Dataset
from workbench.diagnosis.claims.cause import Cause, ResidualMap, is_named
from workbench.diagnosis.drivers.evidence import FollowedDriver
from workbench.diagnosis.next_poses import NextReason
from workbench.diagnosis.remaining_error import RemainingError
from workbench.identification.errors.row_errors import Errors, Validation
from workbench.identification.fit import Fit
from workbench.identification.noise import STUDENT_FREEDOM
from workbench.identification.problem import Noise
from workbench.identification.result import BeforeAfter, Identification
from workbench.identification.rows.row_selection import AbstractSplit
from workbench.identification.run import Run
from workbench.report.result_display import AbstractReported

if TYPE_CHECKING:
    from pandas import DataFrame

WORTHWHILE_RATIO = 0.9
"""Ratio of a standard error after to before below which a further pose is worthwhile."""


class Verdict(StrEnum):
    """Verdict of a diagnosis."""

    NO_EFFECT = "no effect found"
    EXPLAINED = "explained"
    PARTLY = "partly explained"
    UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class Now:
    """The saved arm: its state after the last event.

    Args:
        row: The first row of the file in this state.
        mean_mm: Its mean error on the fitted rows from there on [mm].
    """

    row: int
    mean_mm: float

    @property
    @beside("the note on the last event", "")
    def sentence(self) -> str:
        size = f", with a mean error of {self.mean_mm:.3g} mm" if np.isfinite(self.mean_mm) else ""
        return f"The saved arm is that after the last event, from row {self.row} on{size}."


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate with its contribution.

    Args:
        effect: With zero coefficients.
        gain: Log evidence that it adds [nat].
        errors: Held-out errors of the arm with it; of the fitted rows if none was held out.
    """

    effect: AbstractEffect
    gain: float
    errors: Errors


@dataclass(frozen=True, eq=False, kw_only=True)
class Accepted:
    """An effect that the diagnosis added to the arm.

    Args:
        effect: With the identified coefficients.
        std: Their standard errors, SI.
        gain: Log evidence that it adds to the others [nat].
        before: Held-out errors of the final model without it, by the linear solution; of the fitted rows if
            none was held out.
        alternatives: Effects that would do nearly as well in its place, best first.
        text: Description in one sentence.
    """

    effect: AbstractEffect
    std: tuple[float, ...]
    gain: float
    before: Errors
    alternatives: tuple[Ranked, ...]
    text: str


@beside("whether the effects do harm", None)
def harm_done(before: Errors, after: Errors, noise: Noise) -> str | None:
    """A warning if a model predicts the same rows worse than the one before, by more than the mean score's
    standard error.

    A row's score is the log density of its errors of position and orientation by Student's law, each in its
    noise per axis.
    """
    gain, worse = np.zeros(len(before.position)), []
    for old, new, sigma, scale, unit in (
        (before.position, after.position, noise.position, 1e3, " mm"),
        (before.rotation, after.rotation, noise.rotation, float(np.rad2deg(1.0)), "°"),
    ):
        seen = np.isfinite(old) & np.isfinite(new)
        if not (seen.any() and np.isfinite(sigma) and sigma > 0.0):
            continue
        room = (STUDENT_FREEDOM * 3.0 * sigma**2, 0.5 * (STUDENT_FREEDOM + 3.0))
        gain[seen] += room[1] * (np.log1p(old[seen] ** 2 / room[0]) - np.log1p(new[seen] ** 2 / room[0]))
        was, now = (scale * float(errors[seen].mean()) for errors in (old, new))
        worse += [f"{now:.3g} instead of {was:.3g}{unit}"] if now > was else []
    if len(gain) < 2 or not worse or gain.mean() >= -gain.std(ddof=1) / np.sqrt(len(gain)):
        return None
    return (
        f"the added effects make the held-out error worse: {', '.join(worse)} with the geometry alone; "
        "use the geometry alone"
    )


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Diagnosis(AbstractReported, AbstractSplit):
    """A whole diagnosis; outliers are among the rows to fit.

    Args:
        nominal_robot: The arm as given, with assumed masses where its file has none.
        outliers: Rows excluded as outliers, indices into data.
        outlier_errors: Errors of the identified arm on them.
        suspects: Held-out rows that no arm explains, indices into held_out_data.
        before_fit: Geometry alone.
        after_fit: Geometry with the accepted effects, on the fitted rows; shown in the figures.
        aligned: The nominal arm with the best base and tool.
        nominal: Its errors; of fitted rows those that are no outliers, as in the two that follow.
        before: Errors of `before_fit`.
        after: Errors of `after_fit`, and what is saved: the same fitted to all rows, held-out ones of the
            same file too.
        causes: Physical causes of significant size among the accepted effects, largest first.
        residual_map: The other effects, which only predict; None if there are none.
        followed: Drivers that the error follows without a law.
        remaining: The error that is left.
        harm: A warning if held-out rows are predicted worse with the effects than without; None if not.
        effects: Accepted effects, the largest contribution first.
        now: The saved arm, if there were events during the measurements.
        is_tried: Whether effects were tried: the rows were enough for that.
        measure_next: Joint positions of poses to measure next [rad or m].
        next_reasons: What each of them would determine.
        warnings: Advice that could not be computed, one sentence each.
    """

    nominal_robot: Robot
    data: Dataset
    outliers: np.ndarray
    outlier_errors: Errors
    suspects: np.ndarray
    before_fit: Fit
    after_fit: Fit
    aligned: Robot
    nominal: Validation
    before: Validation
    after: Run
    causes: tuple[Cause, ...]
    residual_map: ResidualMap | None
    followed: tuple[FollowedDriver, ...]
    remaining: RemainingError
    harm: str | None
    verdict: Verdict
    message: str
    effects: tuple[Accepted, ...]
    now: Now | None
    is_tried: bool
    measure_next: Float[np.ndarray, "_ n"]
    next_reasons: tuple[NextReason, ...] = ()
    seconds: float = 0.0
    warnings: tuple[str, ...] = ()

    @cached_property
    def calibrated(self) -> Robot:
        """The arm with identified geometry and accepted effects, fitted to all rows."""
        return self.identification().robot

    @property
    def robot(self) -> Robot:
        """The same, under the name that every result has for its arm."""
        return self.calibrated

    @property
    def events(self) -> tuple[AbstractEvent, ...]:
        """Claimed events during the measurements, in row order."""
        return tuple(sorted((c.event for c in self.causes if c.event is not None), key=lambda e: e.moment))

    @property
    def is_named(self) -> bool:
        """Whether causes, all of them at least probable, explain more than the residual map."""
        return is_named(self.causes, self.residual_map, *self.error)

    @property
    @beside("whether the verdict is conclusive", False)
    def is_good(self) -> bool:
        """Whether the verdict is conclusive: noise alone, or named causes."""
        if self.harm is not None or not self.is_tried:
            return False
        return self.verdict in (Verdict.NO_EFFECT, Verdict.EXPLAINED)

    @property
    @beside("the text of the verdict", "no verdict")
    def verdict_text(self) -> str:
        """The verdict for people; an error without a named cause is not called explained."""
        if not self.is_tried:
            return "no effects were looked for"
        if self.residual_map is not None and not self.causes:
            partly = "partly " if self.verdict is Verdict.PARTLY else ""
            return f"{partly}predicted, but no cause is named"
        return str(self.verdict)

    @property
    @beside("whether to measure more", False)
    def worth_measuring(self) -> bool:
        """Whether a pose to measure next would make a standard error noticeably smaller."""
        return any(reason.shrinks_to < WORTHWHILE_RATIO for reason in self.next_reasons)

    @property
    def error(self) -> BeforeAfter:
        """Errors of the geometry alone and with the accepted effects."""
        return BeforeAfter(self.before.judged, self.after.judged)

    def identification(self) -> Identification:
        """The arm as the result of an identification, with the errors before the refit to all rows."""
        is_outlier = np.isin(self.train_rows, self.outliers)
        split = self.split | {
            "train_rows": self.train_rows[~is_outlier],
            "excluded": (*self.excluded, *((int(row), "outlier") for row in self.data.row[self.outliers])),
        }
        return Identification(
            nominal_robot=self.nominal_robot,
            aligned=self.aligned,
            data=self.data,
            nominal=self.nominal,
            runs={self.after.fit.algorithm.name: self.after},
            harm=self.harm,
            **split,
        )

    def parameters(self) -> "DataFrame":
        """Constants and effects of the saved arm by name: unit, nominal, identified, standard error; SI."""
        return self.after.fit.to_frame()

    def residuals(self) -> "DataFrame":
        """Measured − predicted with the accepted effects, as `Identification.residuals`."""
        return self.identification().residuals()
