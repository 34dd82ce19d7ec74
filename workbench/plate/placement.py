"""Whether a plate can stand where it is said to: with targets, and outside the robot's base."""

import numpy as np

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.errors import DataError
from workbench.plate.plate import Plate

SAMPLES = 33
"""Points checked along the base's column."""


def check_place(robot: Robot, plate: Plate) -> None:
    """Refuse a plate that nothing can be measured on.

    The base is taken as the line from its foot to the second joint's axis: the column that no arm lacks.

    Raises:
        DataError: no targets, or a solid that the base's column stands in.
    """
    if not len(plate):
        raise DataError(f"plate '{plate.name}' has no targets; add [[target]] tables")
    if plate.size is None:
        return
    frames = se3.inverse(robot.base.pose) @ link_frames(robot, Motion(np.zeros((1, robot.dof))))[0]
    top = frames[1, :3, 3] if len(frames) > 1 else np.zeros(3)
    column = np.linspace(0.0, 1.0, SAMPLES)[:, None] * top
    inside = se3.apply(se3.inverse(plate.pose), column)
    half = 0.5 * plate.size
    within = (np.abs(inside[:, :2]) <= half[:2]).all(1) & (inside[:, 2] <= 0) & (inside[:, 2] >= -2 * half[2])
    if within.any():
        x, y, z = 1e3 * column[np.argmax(within)]
        raise DataError(
            f"plate '{plate.name}' stands in the robot's base: its solid contains the point "
            f"({x:.0f}, {y:.0f}, {z:.0f}) mm of the base's column; move the plate or make it smaller"
        )
