"""What stands for an arm, measurements, a trajectory and a requirement in calls: names, files, text."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.arguments import Like, Reads, pair_of
from workbench.base.types import frozen
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.data.dataset import Dataset
from workbench.data.readers import Trajectory, read_measurements, read_trajectory


def as_robot(value: Any, given: Any = None) -> Any:
    """A robot of its file, or of the name of a built-in arm; anything else as it is."""
    return load_robot(value) if isinstance(value, str | Path) else value


def as_dataset(value: Any, robot: Robot | None = None) -> Any:
    """Measurements of a file or a frame, with as many joints as the arm has."""
    if isinstance(value, Dataset) or not (isinstance(value, str | Path) or hasattr(value, "columns")):
        return value
    return read_measurements(value, joints=robot)


def _dataset_of_arm(value: Any, given: Any) -> Any:
    return as_dataset(value, next((found for found in given.values() if isinstance(found, Robot)), None))


def _trajectory(value: Any, given: Any) -> Any:
    """A file, a frame, joint positions (rows, n) [rad or m], or poses of the tool (rows, 4, 4)."""
    if isinstance(value, str | Path) or hasattr(value, "columns"):
        return read_trajectory(value)
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fi" or not np.isfinite(value).all():
        return value
    rows = value.astype(float)
    if rows.ndim == 3 and rows.shape[1:] == (4, 4):
        return Trajectory(position=frozen(rows[:, :3, 3]), rotation=frozen(rows[:, :3, :3]))
    return Trajectory(q=frozen(rows)) if rows.ndim == 2 and len(rows) else value


def _wanted(value: Any, given: Any) -> Any:
    if isinstance(value, Requirement):
        return value.wanted
    if (pair := pair_of(value)) is None:
        return value
    return Wanted(position=pair[0], rotation=pair[1] if len(pair) == 2 else None)


RobotLike = Like[Annotated[Robot, Reads("a Robot, its file, or a built-in arm by name", as_robot)]]
DatasetLike = Like[Annotated[Dataset, Reads("a Dataset, a file, or a data frame", _dataset_of_arm)]]
_PATH = "a Trajectory, its file, a data frame, joints (rows, n) or poses (rows, 4, 4)"
TrajectoryLike = Like[Annotated[Trajectory, Reads(_PATH, _trajectory)]]
_ERRORS = 'an error in m, or text such as "0.3mm" or "0.3mm,0.1deg"'
WantedLike = Like[Annotated[Wanted, Reads(_ERRORS, _wanted)]]
