"""A corrected trajectory, with its predicted errors."""

from dataclasses import dataclass
from enum import StrEnum
from typing import final

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.motion import Motion
from workbench.base.wording import plural
from workbench.extras.trajectories.path import Commanded
from workbench.identification.errors.row_errors import Spread
from workbench.report.blocks import Block, ResultTable, headed
from workbench.report.json import Json, document
from workbench.report.numbers import short
from workbench.report.result_display import AbstractShown

SCHEMA = "workbench.compensation/1"

ACCEPTED_ERROR = 1e-6
"""Remaining error of an iterated correction above which it is reported [m]."""


class CorrectionMethod(StrEnum):
    """How a trajectory is corrected."""

    ONE_STEP = "one-step"
    ITERATED = "iterated"


@dataclass(frozen=True, eq=False)
class PathErrors:
    """Errors of an arm along a path, row by row.

    Args:
        position: Distance from the commanded position [m].
        rotation: Angle to the commanded orientation, as far as the task requires [rad].
    """

    position: Float[np.ndarray, " rows"]
    rotation: Float[np.ndarray, " rows"]

    @property
    def spreads(self) -> dict[str, Spread]:
        """Of positions [mm] and orientations [°], by their keys in a file."""
        position, rotation = 1e3 * self.position, np.rad2deg(self.rotation)
        return {"position_mm": Spread.of(position), "orientation_deg": Spread.of(rotation)}

    def cells(self, what: str) -> tuple[str, ...]:
        """Means and maxima, as a row of a table."""
        return what, *(short(size) for spread in self.spreads.values() for size in (spread.mean, spread.max))

    def json(self) -> Json:
        return {key: spread._asdict() for key, spread in self.spreads.items()}


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Compensation(AbstractShown):
    """A corrected trajectory.

    Args:
        commanded: The path as commanded.
        motion: The corrected joint positions, with drivers of effects.
        before: Predicted errors of the calibrated arm without correction.
        after: Its predicted errors with it.
        kept: Uncorrected rows, which a correction would have made worse.
        speed: Maximum speed of every joint with the correction [rad/s or m/s]; None without time.
    """

    commanded: Commanded
    motion: Motion
    method: CorrectionMethod
    before: PathErrors
    after: PathErrors
    kept: Bool[np.ndarray, " rows"]
    speed: Float[np.ndarray, " n"] | None
    notes: tuple[str, ...]

    @property
    def q(self) -> Float[np.ndarray, "rows n"]:
        """Corrected joint positions [rad or m]."""
        return self.motion.q

    def blocks(self) -> list[Block]:
        """Predicted errors before and after, and decisions."""
        rows = [self.before.cells("as commanded")]
        if self.after.position.max() > ACCEPTED_ERROR:
            rows.append(self.after.cells(f"corrected ({self.method})"))
        own, mean, angle = self.commanded.expected, "–", "–"
        if own is not None:
            mean, angle = short(1e3 * own.position), short(np.rad2deg(own.rotation))
        rows.append(("corrected (model error on held-out rows)", mean, "–", angle, "–"))
        headings = ("predicted error", "mean [mm]", "max [mm]", "mean [°]", "max [°]")
        head = f"{self.commanded.calibrated.name}: {plural(len(self.q), 'row')}"
        return headed(head, ResultTable("", headings, rows), notes=self.notes)

    def json(self) -> Json:
        """The result as plain data; rows count from 0. Errors are predicted by the calibrated model, without
        its own error (`model_error` [m, rad], from held-out rows).
        """
        commanded, time = self.commanded, self.motion.time
        columns = {
            "row": np.arange(len(self.q)),
            "time": [None] * len(self.q) if time is None else time,
            "before_mm": 1e3 * self.before.position,
            "after_mm": 1e3 * self.after.position,
            "kept": self.kept,
        }
        return document(
            SCHEMA,
            robot=commanded.calibrated.name,
            method=self.method,
            task=commanded.task.name.lower(),
            effects=[e.name for e in commanded.calibrated.effects],
            before=self.before.json(),
            after=self.after.json(),
            model_error=None if commanded.expected is None else list(commanded.expected),
            largest_correction=np.abs(self.q - commanded.q).max(0),
            greatest_speed=self.speed,
            rows=[dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
            notes=self.notes,
        )
