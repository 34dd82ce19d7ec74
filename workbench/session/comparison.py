"""Measured against predicted, row by row, in the robot's base frame, as shown by the overlay.

Every session of measurements may have its own base and tool. The base of the shown fit (or, before there is
one, the nominal base) brings measured and predicted poses alike into the base's frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import frozen
from workbench.data.dataset import Dataset
from workbench.data.prediction import predict

MIN_TIMES, MAX_TIMES = 1.0, 1000.0
"""Factors by which errors can be drawn larger."""
SHARE_OF_REACH = 0.05
"""Share of the reach by which the nominal arm's mean error is drawn at first."""


class ModelStage(StrEnum):
    """Stages of the model."""

    NOMINAL = "nominal"
    GEOMETRY = "geometry"
    EFFECTS = "with effects"


STAGES = tuple(ModelStage)


@dataclass(frozen=True, eq=False)
class Comparison:
    """All rows that can be looked at: fitted, then held out, then kept out.

    Args:
        q: Joint positions [rad or m].
        number: Data row of each, counted from 0.
        held_out: Rows that were not fitted, but judge the fit.
        kept_out: Rows that neither were fitted nor judge; their `errors` would dwarf all others.
        measured: Measured positions [m]; NaN where none was measured.
        nominal: Poses that the nominal arm predicts, on the best base and with the best tool.
        residuals: From measured to predicted position, for every stage [m]; NaN where there is no such model,
            or no position was measured.
        set_apart: Rows that no arm explains: set apart, or suspects held out.
        models: The arm at every stage that is known, placed as the rows were.
    """

    q: Float[np.ndarray, "rows n"]
    number: np.ndarray
    held_out: Bool[np.ndarray, " rows"]
    kept_out: Bool[np.ndarray, " rows"]
    measured: Float[np.ndarray, "rows 3"]
    nominal: Float[np.ndarray, "rows 4 4"]
    residuals: Float[np.ndarray, "rows 3 3"]
    set_apart: Bool[np.ndarray, " rows"]
    models: Mapping[ModelStage, Robot] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.q)

    @cached_property
    def stage_errors(self) -> Float[np.ndarray, "rows 3"]:
        """Position error at every stage [m]; NaN where unknown, and for rows that are kept out."""
        return frozen(np.where(self.kept_out[:, None], np.nan, self.errors))

    @property
    def errors(self) -> Float[np.ndarray, "rows 3"]:
        """The same with those of rows that are kept out."""
        return np.linalg.norm(self.residuals, axis=2)

    @cached_property
    def stages(self) -> tuple[ModelStage, ...]:
        known = np.isfinite(self.stage_errors).any(0)
        return tuple(stage for stage, is_known in zip(STAGES, known, strict=True) if is_known)

    @property
    def worst(self) -> np.ndarray:
        """Indices of the rows by the error of the last model, the largest first."""
        last = [STAGES.index(stage) for stage in self.stages[-1:]]
        return np.argsort(-np.nan_to_num(self.stage_errors[:, last]).sum(1), kind="stable")


def times_for(errors: Float[np.ndarray, " rows"], reach: float) -> float:
    """The factor at which the mean of these errors [m] is drawn as 5 % of the reach, to two digits."""
    known = errors[np.isfinite(errors)]
    mean = float(known.mean()) if len(known) else 0.0
    if mean <= SHARE_OF_REACH * reach / MAX_TIMES:
        return MAX_TIMES
    return max(float(f"{SHARE_OF_REACH * reach / mean:.2g}"), MIN_TIMES)


def compare(
    fitted: Dataset,
    checks: Dataset | None,
    kept_out: Dataset | None,
    nominal: Robot,
    models: Mapping[ModelStage, Robot],
) -> Comparison:
    """Measured and predicted poses of all rows.

    Args:
        fitted: Rows that are fitted, or will be.
        checks: Rows that are held out.
        kept_out: Rows that are neither.
        nominal: The nominal arm, on its best base.
        models: The arm of every stage that is known.
    """
    every = (fitted, ""), (checks, "held_out"), (kept_out, "kept_out")
    parts = [_compared(rows, nominal, models, kind) for rows, kind in every if rows is not None and len(rows)]
    columns: dict[str, Any] = {}
    for f in (f for f in fields(Comparison) if f.name != "models"):
        columns[f.name] = frozen(np.concatenate([getattr(part, f.name) for part in parts]))
    return Comparison(**columns, models=models)


def _compared(data: Dataset, nominal: Robot, models: Mapping[ModelStage, Robot], kind: str) -> Comparison:
    """The rows of one dataset, with whatever it knows of payload, temperature and the like."""
    to_base = np.empty((len(data), 4, 4))  # from the measuring frame
    for name in data.sessions:
        to_base[data.in_session(name)] = se3.inverse(nominal.in_session(name).base.pose)
    position = np.full((len(data), 3), np.nan) if data.position is None else data.position
    expected = predict(nominal, data)
    residuals = np.full((len(data), len(STAGES), 3), np.nan)
    for stage, robot in models.items():
        off = (expected if robot is nominal else predict(robot, data))[:, :3, 3] - position
        residuals[:, STAGES.index(stage)] = np.einsum("rij,rj->ri", to_base[:, :3, :3], off)
    return Comparison(
        q=data.q,
        number=data.row,
        held_out=np.full(len(data), kind == "held_out"),
        kept_out=np.full(len(data), kind == "kept_out"),
        measured=se3.apply(to_base, position),
        nominal=to_base @ expected,
        residuals=residuals,
        set_apart=np.full(len(data), False),
    )


@dataclass(frozen=True, kw_only=True)
class Overlay:
    """What is laid over the scene.

    Args:
        points: Where the tool was measured, coloured by its error once there is a fit.
        stage: The model whose errors are shown; of those not known, the last one before; None: the model as
            it is now (`stages.shown_stage`).
        arrows: Errors from measured to predicted places.
        ghosts: The other branches that reach the selected target.
        exaggeration: How many times larger than they are all errors are drawn: of arms, arrows, paths.
    """

    points: bool = True
    stage: ModelStage | None = None
    arrows: bool = True
    ghosts: bool = False
    exaggeration: float = 50.0
