"""Patterns: places for targets chosen by hand rather than computed (the arbitrary choice of ARIA §4.3).

A pattern spreads targets over a horizontal square or circle and tilts them in turn; the circle of ten with
tilts of −150° and −160° is the paper's Table 2.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.arm.robot import Robot
from workbench.base.errors import OptionError
from workbench.base.types import Vector3, frozen
from workbench.plate.plate import Plate, Target
from workbench.plate.region import Region

Places = Float[np.ndarray, "number 2"]
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


def on_circle(number: int) -> Places:
    """Evenly on the unit circle, the first along +x, anticlockwise."""
    angles = 2.0 * np.pi * np.arange(number) / number
    return np.stack([np.cos(angles), np.sin(angles)], -1)


def on_line(number: int) -> Places:
    """Evenly along x from −1 to 1."""
    along = np.linspace(-1.0, 1.0, number) if number > 1 else np.zeros(1)
    return np.stack([along, np.zeros(number)], -1)


def on_grid(number: int) -> Places:
    """Row by row over the square from −1 to 1, as nearly square as so many allow."""
    columns = int(np.ceil(np.sqrt(number)))
    rows = -(-number // columns)
    x, y = (np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1) for n in (columns, rows))
    return np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)[:number]


def on_spiral(number: int) -> Places:
    """Evenly over the unit disc: radius √(k/n) at multiples of the golden angle.

    Source: Vogel, A better way to construct the sunflower head, Mathematical Biosciences 44, 1979.
    """
    k = np.arange(number) + 0.5
    angles = np.pi * (3.0 - np.sqrt(5.0)) * k
    return np.sqrt(k / number)[:, None] * np.stack([np.cos(angles), np.sin(angles)], -1)


PATTERNS: Mapping[str, Callable[[int], Places]] = MappingProxyType(
    {"circle": on_circle, "line": on_line, "grid": on_grid, "spiral": on_spiral}
)
"""Places within the unit square by the pattern's name."""


def pattern(
    name: str, number: int, *, centre: Vector3, radius: float, tilts: tuple[float, ...] = TILTS
) -> tuple[Target, ...]:
    """Targets in a pattern.

    Args:
        name: One of `PATTERNS`.
        centre: Middle of the pattern, robot's base [m].
        radius: Half its width [m].
        tilts: Roll angles given to the targets in turn [rad].
    """
    if name not in PATTERNS:
        raise OptionError(f"unknown pattern '{name}'; known: {', '.join(PATTERNS)}")
    if not 1 <= number <= MAX_TARGETS:
        raise OptionError(f"a pattern has 1 to {MAX_TARGETS} targets, got {number}")
    if not (np.isfinite(radius) and radius > 0 and tilts):
        raise OptionError(f"the half width of a pattern must be positive, got {radius:g} m")
    places = np.column_stack([radius * PATTERNS[name](number), np.zeros(number)]) + centre
    return tuple(
        Target(frozen(place), frozen(np.array([tilts[i % len(tilts)], 0.0, 0.0])))
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
        targets=pattern("circle", TARGETS, centre=middle, radius=radius),
        region=Region(min=usual - half * [1, 1, 0.5], max=usual + 1.5 * half, cube=float(0.05 * reach)),
        xyz=frozen(middle - [0.0, 0.0, 0.05]),
        size=frozen(np.array([side, side, 0.012])),
    )
