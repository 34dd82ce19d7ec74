"""The plate that an arm begins on: targets on a circle, tilted in turn (the arbitrary choice of ARIA §4.3).

The circle of ten with tilts of −150° and −160° is the paper's Table 2.
"""

import numpy as np

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base.types import Vector3, frozen
from workbench.plate.plate import Plate, Target
from workbench.plate.region import Region

MAX_TARGETS = 200
"""More targets than this are refused."""
CIRCLE, TARGETS = "Circle", 10
"""Name and number of targets of the default plate."""
CENTRE = (0.45, 0.25)
"""Where its middle is: before the base and above it, as shares of the arm's reach."""
ROOM = 0.14
"""Minimum radius of that circle [m]: its blocks stand side by side."""
TILTS = (float(np.deg2rad(-150.0)), float(np.deg2rad(-160.0)))
"""Roll angles of Table 2 [rad]."""


def circle(number: int, *, centre: Vector3, radius: float) -> tuple[Target, ...]:
    """Targets evenly on a horizontal circle, anticlockwise, tilted in turn.

    Args:
        centre: Middle of the circle, robot's base [m].
        radius: Its radius [m].
    """
    angles = 2.0 * np.pi * np.arange(number) / number
    places = radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], -1) + centre
    return tuple(
        Target(frozen(place), frozen(np.array([TILTS[i % len(TILTS)], 0.0, 0.0])))
        for i, place in enumerate(places)
    )


def circle_before(robot: Robot, centre: tuple[float, float] = CENTRE) -> Plate:
    """A circle of targets before an arm, sized by its reach; above the floor that it stands on.

    Args:
        centre: How far before the base and how high its middle is, as shares of the reach; the region stays.
    """
    reach, floor = robot.reach, [0.0, 0.0, height_above_floor(robot)]
    middle, usual = (np.array([x, 0.0, z]) * reach - floor for x, z in (centre, CENTRE))
    half = np.array([0.2, 0.24, 0.12]) * reach
    radius = max(0.16 * reach, ROOM)
    side = 2.0 * radius + 0.1 * reach
    return Plate(
        name=CIRCLE,
        targets=circle(TARGETS, centre=middle, radius=radius),
        region=Region(min=usual - half * [1, 1, 0.5], max=usual + 1.5 * half, cube=float(0.05 * reach)),
        xyz=frozen(middle - [0.0, 0.0, 0.05]),
        size=frozen(np.array([side, side, 0.012])),
    )
