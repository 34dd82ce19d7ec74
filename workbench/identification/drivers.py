"""What drives a robot's effects, where the rows do not say it but let it be found out."""

from workbench.arm.robot import Robot
from workbench.data.dataset import Dataset
from workbench.data.directions import with_directions


def with_drivers(robot: Robot, data: Dataset) -> Dataset:
    """The rows with directions of motion, from their order in time, where an effect of the robot needs them.

    Rows that have them, or no times, are as they were; an effect that still misses them says so.
    """
    needed = any("direction" in effect.needs for effect in robot.effects)
    return with_directions(data) if needed else data
