"""What stands for an arm, measurements, a trajectory and a requirement in calls: names, files, text."""

from pathlib import Path
from typing import Annotated, Any

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.arguments import Like, Reads, pair_of
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.data.dataset import Dataset
from workbench.data.readers import Trajectory, read_measurements, read_trajectory


def as_robot(value: Any) -> Any:
    """A robot of its file, or of the name of a built-in arm; anything else as it is."""
    return load_robot(value) if isinstance(value, str | Path) else value


def as_dataset(value: Any, robot: Robot | None = None) -> Any:
    """Measurements of a file or a frame, with as many joints as the arm has and on its base."""
    if isinstance(value, Dataset) or not (isinstance(value, str | Path) or hasattr(value, "columns")):
        return value
    if robot is None:
        return read_measurements(value)
    return read_measurements(value, joints=robot.joint_names, base=robot.base.pose)


def _dataset_of_arm(value: Any, given: Any) -> Any:
    return as_dataset(value, next((found for found in given.values() if isinstance(found, Robot)), None))


def _trajectory(value: Any, given: Any) -> Any:
    return read_trajectory(value) if isinstance(value, str | Path) else value


def _wanted(value: Any, given: Any) -> Any:
    if isinstance(value, Requirement):
        return value.wanted
    if (pair := pair_of(value)) is None:
        return value
    return Wanted(position=pair[0], rotation=pair[1] if len(pair) == 2 else None)


RobotLike = Like[
    Annotated[
        Robot, Reads("a Robot, its file, or a built-in arm by name", lambda value, given: as_robot(value))
    ]
]
DatasetLike = Like[Annotated[Dataset, Reads("a Dataset, a file, or a data frame", _dataset_of_arm)]]
TrajectoryLike = Like[Annotated[Trajectory, Reads("a Trajectory or its file", _trajectory)]]
WantedLike = Like[
    Annotated[Wanted, Reads('an error in m, or text such as "0.3mm" or "0.3mm,0.1deg"', _wanted)]
]
