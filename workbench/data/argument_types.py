"""What stands for an arm, measurements, a trajectory and a requirement in calls: names, files, text."""

from pathlib import Path
from typing import Any

from workbench.arm.built_in_arms import load_robot
from workbench.arm.robot import Robot
from workbench.base.argument_checks import Given, accept, pair_of
from workbench.data.accuracy_requirement import Requirement, Wanted
from workbench.data.dataset import Dataset
from workbench.data.readers import Trajectory, read_measurements, read_trajectory


def _robot(value: Any, given: Given) -> Any:
    return load_robot(value) if isinstance(value, str | Path) else value


def _dataset(value: Any, given: Given) -> Any:
    """A file or a frame, with as many joints as the arm that stands before it and on its base."""
    if isinstance(value, Dataset) or not (isinstance(value, str | Path) or hasattr(value, "columns")):
        return value
    robot = next((found for found in given.values() if isinstance(found, Robot)), None)
    if robot is None:
        return read_measurements(value)
    return read_measurements(value, joints=robot.joint_names, base=robot.base.pose)


def _trajectory(value: Any, given: Given) -> Any:
    return read_trajectory(value) if isinstance(value, str | Path) else value


def _wanted(value: Any, given: Given) -> Any:
    if isinstance(value, Requirement):
        return value.wanted
    if (pair := pair_of(value)) is None:
        return value
    return Wanted(position=pair[0], rotation=pair[1] if len(pair) == 2 else None)


accept(Robot, "a Robot, its file, or a built-in arm by name", _robot)
accept(Dataset, "a Dataset, a file, or a data frame", _dataset)
accept(Trajectory, "a Trajectory or its file", _trajectory)
accept(Wanted, 'an error in m, or text such as "0.3mm" or "0.3mm,0.1deg"', _wanted)
