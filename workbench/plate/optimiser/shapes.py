"""Shapes that must not touch: convex hulls that stand still, and an arm as bodies that move with its links.

An arm is a row of pieces, each fixed to a body: 0 is the base, k the link after moving joint k. Neighbouring
bodies touch by design and are never checked against each other in full. The probe, at the end of the last
body, alone may touch the block of the target that it visits. Distances are in metres, in the robot's base.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.plate.optimiser.target_blocks import block_corners
from workbench.plate.plate import SQUARE, Plate

FAR = 0.5
"""Distances above this are not measured [m]."""
ON_THE_TABLE = 1
"""Bodies up to this one stand on the table: the base's post and the link after the first joint."""
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], *([i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4))])
"""Corners of the six faces of a hull, anticlockwise from outside."""

Placements = Float[np.ndarray, "rows pieces ..."]
"""Where the pieces of an arm are, in a form of their own."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex body of six flat faces that stands still.

    Args:
        corners: Four of its foot and four of its top, anticlockwise from above, in the robot's base [m].
    """

    corners: Float[np.ndarray, "8 3"]

    @cached_property
    def shape(self) -> coal.ConvexBase:
        """The body for coal."""
        return convex(self.corners)

    @cached_property
    def bounds(self) -> Float[np.ndarray, "28"]:
        """Centre and radius of a sphere about it, normals of its faces, and how far out these lie [m]."""
        centre = self.corners.mean(0)
        faces = self.corners[FACES]
        normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        size = np.linalg.norm(self.corners - centre, axis=1).max()
        return np.concatenate([centre, [size], normals.ravel(), (normals * faces[:, 0]).sum(-1)])

    @property
    def hull(self) -> coal.ConvexBase:
        """The same: it is convex."""
        return self.shape


def convex(points: Float[np.ndarray, "points 3"]) -> coal.ConvexBase:
    """Convex hull of some points for coal."""
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
    """An arm's pieces, and how far they are from each other, from hulls and from the table.

    Attributes:
        source: What the pieces are, as a sentence for the notes of a result.
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
        """Where the pieces are at joint positions [rad or m]."""

    @abstractmethod
    def lowest(self, placements: Placements) -> Float[np.ndarray, "rows pieces"]:
        """Height of the lowest point of each piece [m]."""

    @abstractmethod
    def own_distances(
        self, placements: Placements, *, far: float = FAR, least: float | None = None
    ) -> Float[np.ndarray, " rows"]:
        """Least distance between pieces of the arm that must not touch, at most `far` [m].

        Args:
            placements: Where the pieces are.
            far: Greatest distance of interest [m].
            least: Where only more or less than this matters: rows with less may be given as 0 [m].
        """

    @abstractmethod
    def hull_distances(
        self,
        placements: Placements,
        hulls: Sequence[Hull],
        *,
        checked: Bool[np.ndarray, " pieces"],
        far: float = FAR,
        least: float | None = None,
    ) -> Float[np.ndarray, " rows"]:
        """Least distance of some pieces from a hull in every row, at most `far` [m].

        Args:
            placements: Where the pieces are.
            hulls: One for all rows, or one for each.
            checked: Which pieces count.
            far: Greatest distance of interest [m].
            least: As for `own_distances`.
        """


def at_least(
    lines: Float[np.ndarray, "rows capsules 2 3"], hulls: Sequence[Hull]
) -> Float[np.ndarray, "rows capsules"]:
    """Lower bounds of lines' distances from hulls: from a sphere about the hull, and beyond each face [m]."""
    bounds = np.stack([hull.bounds for hull in hulls]) if len(hulls) else np.zeros((0, 28))
    centre, size, normals, offsets = np.split(bounds, [3, 4, 22], axis=1)
    start, along = lines[:, :, 0], lines[:, :, 1] - lines[:, :, 0]
    square = np.maximum((along**2).sum(-1), 1e-30)
    share = np.clip(((centre[:, None] - start) * along).sum(-1) / square, 0.0, 1.0)
    ball = np.linalg.norm(start + share[..., None] * along - centre[:, None], axis=-1) - size
    normals = normals.reshape(-1, 1, 6, 3)
    beyond = lines @ np.swapaxes(normals, 2, 3) - offsets[:, None, None]
    return np.maximum(ball, beyond.min(2).max(-1))


def turned_to(z: np.ndarray) -> np.ndarray:
    """A rotation whose z axis is given."""
    sign = 1.0 if z[2] >= 0.0 else -1.0
    a = -1.0 / (sign + z[2])
    b = z[0] * z[1] * a
    return np.array(
        [
            [1.0 + sign * z[0] ** 2 * a, b, z[0]],
            [sign * b, sign + z[1] ** 2 * a, z[1]],
            [-sign * z[0], -z[1], z[2]],
        ]
    )
