"""Collision shapes: static convex hulls, and the arm as bodies that move with its links.

An arm is a row of pieces, each fixed to a body: 0 is the base, k the link after moving joint k. Neighbouring
bodies touch by design and are never checked against each other in full. The probe, at the end of the last
body, alone may touch the block of the target that it visits. Distances are in metres, in the robot's base.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Vector3
from workbench.plate.optimiser import segments
from workbench.plate.optimiser.target_blocks import block_corners
from workbench.plate.plate import SQUARE, Plate

if TYPE_CHECKING:
    import coal

MAX_MEASURED_DISTANCE = 0.5
"""Distances above this are not measured [m]."""
ON_THE_TABLE = 1
"""Last body that may touch the table: the base's post and the link after the first joint."""
Placements = Float[np.ndarray, "rows pieces ..."]
"""Placements of the pieces of an arm, in a format of the shape."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex body of six flat faces that stands still.

    Args:
        corners: Four of its foot and four of its top, anticlockwise from above, in the robot's base [m].
    """

    corners: Float[np.ndarray, "8 3"]

    @cached_property
    def shape(self) -> "coal.ConvexBase":
        return convex(self.corners)

    @property
    def hull(self) -> "coal.ConvexBase":
        return self.shape


def convex(points: Float[np.ndarray, "points 3"]) -> "coal.ConvexBase":
    import coal  # a twentieth of a second, for which arms of capsules alone have no use

    listed = coal.StdVec_Vec3s()
    for point in points:
        listed.append(np.asarray(point, float))
    return coal.Convex.convexHull(listed, True, "Qt")


def plate_hull(plate: Plate) -> Hull | None:
    """The plate's solid; None if it has none."""
    if plate.size is None:
        return None
    square = 0.5 * plate.size[:2] * SQUARE
    layers = [np.column_stack([square, np.full(4, height)]) for height in (-plate.size[2], 0.0)]
    return Hull(se3.apply(plate.pose, np.concatenate(layers)))


def block_hulls(plate: Plate, poses: Float[np.ndarray, "rows 4 4"]) -> list[Hull]:
    """The blocks of targets at poses (robot's base)."""
    return [Hull(corners) for corners in block_corners(plate, poses)]


class AbstractArmShape(ABC):
    """An arm's pieces, and their distances from each other, from hulls and from the table.

    Attributes:
        source: Description of the pieces, a sentence for the notes of a result.
    """

    robot: Robot
    source: str

    @property
    @abstractmethod
    def bodies(self) -> Int[np.ndarray, " pieces"]:
        """Body of each piece."""

    @property
    @abstractmethod
    def probes(self) -> Bool[np.ndarray, " pieces"]:
        """Which pieces are the probe."""

    @abstractmethod
    def placements(self, q: Float[np.ndarray, "rows n"]) -> Placements:
        """Placements of the pieces at joint positions [rad or m]."""

    @abstractmethod
    def lowest(self, placements: Placements) -> Float[np.ndarray, "rows pieces"]:
        """Height of the lowest point of each piece [m]."""

    @abstractmethod
    def own_distances(
        self, placements: Placements, *, far: float = MAX_MEASURED_DISTANCE, minimum: float | None = None
    ) -> Float[np.ndarray, " rows"]:
        """Minimum distance between pieces of the arm that must not touch, at most `far` [m].

        Args:
            placements: Where the pieces are.
            far: Maximum distance of interest [m].
            minimum: Rows with a smaller distance than this may be given as 0 [m].
        """

    @abstractmethod
    def hull_distances(
        self,
        placements: Placements,
        hulls: Sequence[Hull],
        *,
        checked: Bool[np.ndarray, " pieces"],
        far: float = MAX_MEASURED_DISTANCE,
        minimum: float | None = None,
    ) -> Float[np.ndarray, " rows"]:
        """Minimum distance of some pieces from a hull in every row, at most `far` [m].

        Args:
            placements: Where the pieces are.
            hulls: One for all rows, or one for each.
            checked: Which pieces count.
            far: Maximum distance of interest [m].
            minimum: As for `own_distances`.
        """


def line_distances(
    lines: Float[np.ndarray, "rows lines 2 3"], hulls: Sequence[Hull], far: Float[np.ndarray, " lines"]
) -> Float[np.ndarray, "rows lines"]:
    """Distance of each line from the hull of its row, as `segments.hull_distances` [m]."""
    if not len(lines):
        return np.zeros(lines.shape[:2])
    return segments.hull_distances(lines, np.stack([hull.corners for hull in hulls]), far)


def turned_to(direction: Vector3) -> Float[np.ndarray, "3 3"]:
    """A rotation whose z axis is the direction."""
    x = np.cross([0.0, 1.0, 0.0], direction)
    if np.linalg.norm(x) < 0.1:
        x = np.cross([1.0, 0.0, 0.0], direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
