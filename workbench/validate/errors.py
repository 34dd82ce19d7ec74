"""Position and orientation errors of a model on measured rows, and their summary."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from workbench.identify.problem import Problem
from workbench.measure.dataset import Dataset
from workbench.robots.robot import Robot


class Spread(NamedTuple):
    """Mean, root mean square and greatest of some errors."""

    mean: float
    rms: float
    max: float

    @classmethod
    def of(cls, errors: Float[np.ndarray, "rows"]) -> "Spread":
        """Summary of one error a row."""
        return cls(float(errors.mean()), float(np.sqrt((errors**2).mean())), float(errors.max()))


@dataclass(frozen=True, eq=False)
class RowErrors:
    """Errors row by row.

    Args:
        position: Distance between measured and predicted point [m].
        rotation: Angle between measured and predicted orientation [rad]; NaN where none was measured.
    """

    position: Float[np.ndarray, "rows"]
    rotation: Float[np.ndarray, "rows"]

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
        known: Places of anchors, contacts or markers from a fit [m]; guessed from the model if None.
    """
    problem = Problem.build(robot, data, free=(), known=known)
    components = problem.physical(problem.residual(problem.start))
    return split_channels(problem, components)


def split_channels(problem: Problem, components: Float[np.ndarray, "m"]) -> RowErrors:
    """Position and rotation error of every row from its residual components [m], [rad]."""
    size, rows, turned = len(problem.data), problem.component_rows, problem.component_channels
    position = np.sqrt(np.bincount(rows[~turned], components[~turned] ** 2, size))
    rotation = np.full(size, np.nan)
    if turned.any():
        with_rotation = np.unique(rows[turned])
        square = np.bincount(rows[turned], components[turned] ** 2, size)
        rotation[with_rotation] = np.sqrt(square[with_rotation])
    return RowErrors(position, rotation)
