"""Errors and residuals row by row as data frames, fitted rows before held-out ones."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from workbench.arm.robot import Robot
from workbench.base.frames import data_frame
from workbench.data.dataset import Dataset
from workbench.data.prediction import row_components
from workbench.identification.row_errors import RowErrors

if TYPE_CHECKING:
    from pandas import DataFrame

AXES = ("x[m]", "y[m]", "z[m]", "rx[rad]", "ry[rad]", "rz[rad]")


def errors_frame(
    numbers: tuple[np.ndarray, np.ndarray], models: Mapping[str, tuple[RowErrors, RowErrors]]
) -> "DataFrame":
    """Sizes of errors by row number.

    Args:
        numbers: Of the fitted and of the held-out rows.
        models: Errors of both by the model's title.
    """
    columns = _numbered(*numbers)
    for title, pair in models.items():
        for name in {**pair[0].columns, **pair[1].columns}:
            parts = [rows.columns.get(name, np.full_like(rows.position, np.nan)) for rows in pair]
            columns[f"{title} {name}"] = np.concatenate(parts)
    return data_frame(columns, index="row")


def residuals_frame(robot: Robot, fitted: Dataset, held_out: Dataset | None = None) -> "DataFrame":
    """Measured − predicted by row number, axis by axis in the measuring frame; NaN where not measured."""
    parts = [part for part in (fitted, held_out) if part is not None]
    columns = _numbered(fitted.row, held_out.row) if held_out is not None else {"row": fitted.row}
    found = [row_components(robot, part) for part in parts]
    values = np.vstack([np.hstack([errors.position, errors.rotation]) for errors in found])
    return data_frame({**columns, **dict(zip(AXES, values.T, strict=True))}, index="row")


def _numbered(fitted: np.ndarray, held_out: np.ndarray) -> dict[str, np.ndarray]:
    numbers = np.concatenate([fitted, held_out])
    return {"row": numbers, "held_out": np.arange(len(numbers)) >= len(fitted)}
