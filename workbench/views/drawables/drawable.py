"""Drawables: plain data in the frame of the robot's base, lengths in metres, colours 0 to 255."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8

from workbench.base.types import Matrix4, Vector3
from workbench.plate.region import Region
from workbench.views.appearance.bodies import Body
from workbench.views.appearance.shapes import Solid

Colour = tuple[int, int, int]


@dataclass(frozen=True, eq=False, kw_only=True)
class Mesh:
    """A solid of one colour.

    Args:
        flat: Whether its triangles are flat, not parts of a round body.
        pose: Where it is; None for a solid that is in the base's frame.
        number: What a click on it tells; None: nothing.
    """

    solid: Solid
    colour: Colour
    opacity: float = 1.0
    flat: bool = False
    pose: Matrix4 | None = None
    number: int | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Arm:
    """The bodies of an arm, in their own colours or as a translucent ghost."""

    bodies: tuple[Body, ...]
    frames: Float[np.ndarray, "bodies 4 4"]
    ghost: Colour | None = None
    opacity: float = 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Points:
    """Round points, or square ones; a click on each tells its number, and goes through negative ones."""

    places: Float[np.ndarray, "points 3"]
    colours: UInt8[np.ndarray, "points 3"]
    radius: float
    numbers: np.ndarray
    are_squares: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class Arrows:
    """Arrows of one colour, so many times thicker than those of errors."""

    starts: Float[np.ndarray, "arrows 3"]
    ends: Float[np.ndarray, "arrows 3"]
    colour: Colour
    thick: float = 1.0


@dataclass(frozen=True, eq=False)
class Cuboid:
    """The edges of a cuboid along the axes, and on its sides those of so many cubes along each."""

    low: Vector3
    high: Vector3
    colour: Colour
    cubes: tuple[int, int, int] = (1, 1, 1)


FILL = 0.7
"""Edge of a drawn cube, as a share of the room that it has: one sees the arm between them."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cubes:
    """Cubes of a region: which are shown, which have a number (others are grey)."""

    region: Region
    shown: Bool[np.ndarray, " cubes"]
    known: Bool[np.ndarray, " cubes"]
    colours: UInt8[np.ndarray, "cubes 3"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Label:
    """Words above a place."""

    text: str
    place: Vector3
