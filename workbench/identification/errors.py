"""Position and orientation errors of a model on measured rows, and their summary."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.identification.algorithms.opt2 import Opt2
from workbench.identification.problem import Problem


class Spread(NamedTuple):
    """Mean, root mean square and greatest of some errors."""

    mean: float
    rms: float
    max: float

    @classmethod
    def of(cls, errors: Float[np.ndarray, " rows"]) -> "Spread":
        """Summary of one error a row."""
        return cls(float(errors.mean()), float(np.sqrt((errors**2).mean())), float(errors.max()))


@dataclass(frozen=True, eq=False)
class RowErrors:
    """Errors row by row.

    Args:
        position: Distance between measured and predicted point [m]; of several markers their rms.
        rotation: Angle between measured and predicted orientation [rad]; NaN where none was measured.
    """

    position: Float[np.ndarray, " rows"]
    rotation: Float[np.ndarray, " rows"]

    @property
    def summary(self) -> "Errors | None":
        """Their summary; None without rows."""
        return Errors.of(self) if len(self.position) else None


@dataclass(frozen=True)
class Errors:
    """Summary of the errors of some rows.

    Args:
        position_mm: Of positions [mm].
        orientation_deg: Of orientations [deg]; None for data without.
    """

    position_mm: Spread
    orientation_deg: Spread | None

    @classmethod
    def of(cls, rows: RowErrors) -> "Errors":
        """Summary of at least one row."""
        turned = rows.rotation[np.isfinite(rows.rotation)]
        orientation = Spread.of(np.rad2deg(turned)) if len(turned) else None
        return cls(Spread.of(1e3 * rows.position), orientation)


def row_errors(robot: Robot, data: Dataset, *, known: Mapping[str, float] | None = None) -> RowErrors:
    """Errors of a model, nothing fitted.

    Args:
        robot: The model, with its frames per session where it has them.
        data: Measured rows.
        known: Places of anchors, contacts or markers [m]; the others are fitted to the rows.
    """
    problem = Problem.build(robot, data, free=(), known=known)
    return split_channels(problem, problem.physical(problem.residual(instrument_fit(problem))))


def instrument_fit(problem: Problem) -> Float[np.ndarray, " u"]:
    """Places of anchors, contacts or markers that suit a model best, where nothing else is unknown."""
    return Opt2(limit=60).search(problem).x if problem.names else problem.start


def split_channels(problem: Problem, components: Float[np.ndarray, " m"]) -> RowErrors:
    """Position and rotation error of every row from its residual components [m], [rad]."""
    size, rows, turned = len(problem.data), problem.component_rows, problem.component_channels
    straight = ~turned & (problem.inverse_sigma > 0.0)
    points = np.maximum(np.bincount(rows[straight], minlength=size) / 3.0, 1.0)
    position = np.sqrt(np.bincount(rows[straight], components[straight] ** 2, size) / points)
    rotation = np.full(size, np.nan)
    if turned.any():
        with_rotation = np.unique(rows[turned])
        square = np.bincount(rows[turned], components[turned] ** 2, size)
        rotation[with_rotation] = np.sqrt(square[with_rotation])
    return RowErrors(position, rotation)
