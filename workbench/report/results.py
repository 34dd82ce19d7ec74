"""What a report needs of a result. The records of `workbench.pipeline`, a higher rung, have all of it."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np

from workbench.identify.problem import Noise
from workbench.identify.result import Fit
from workbench.measure.dataset import Dataset
from workbench.robots.robot import Robot
from workbench.validate.errors import Errors, RowErrors


@runtime_checkable
class Validated(Protocol):
    """Errors on the training and on the held-out rows; None where there are none."""

    train: Errors | None
    held_out: Errors | None


@runtime_checkable
class FittedRun(Validated, Protocol):
    """One algorithm's fit and its errors, summed up and row by row."""

    fit: Fit
    train_rows: RowErrors
    held_out_rows: RowErrors


@runtime_checkable
class Identified(Protocol):
    """A whole identification: `workbench.pipeline.Identification`."""

    robot: Robot
    aligned: Robot
    data: Dataset
    train_rows: np.ndarray
    held_out_rows: np.ndarray
    held_out_data: Dataset
    excluded: tuple[tuple[int, str], ...]
    noise: Noise
    notes: tuple[str, ...]
    nominal: Validated
    nominal_rows: tuple[RowErrors, RowErrors]
    runs: Mapping[str, FittedRun]
    best: FittedRun
    unidentifiable: tuple[str, ...]
    warnings: tuple[str, ...]


@runtime_checkable
class Evaluated(Protocol):
    """Errors of a given model: `workbench.pipeline.Evaluation`."""

    robot: Robot
    errors: Errors
    rows: RowErrors
    row_numbers: np.ndarray
    notes: tuple[str, ...]
