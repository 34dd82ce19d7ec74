"""Clearance: how far an arm keeps from plate, blocks, table and itself, by exact distances of convex bodies.

Capsules against boxes and convex hulls are measured by coal (GJK); a sphere about every hull spares most of
these. Distances are negative where bodies overlap. Everything is in the robot's base.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import coal
import numpy as np
from jaxtyping import Bool, Float

from workbench.base import se3
from workbench.plate.optimiser.blocks import block_corners
from workbench.plate.optimiser.capsules import ON_THE_TABLE, ArmShape
from workbench.plate.plate import SQUARE, Plate

FAR = 0.5
"""Distances above this are not told apart [m]."""


FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], *([i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4))])
"""Corners of the six faces of a hull, anticlockwise from outside."""


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
        points = coal.StdVec_Vec3s()
        for corner in self.corners:
            points.append(np.asarray(corner, float))
        return coal.Convex.convexHull(points, True, "Qt")


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


def hull_distances(
    arm: ArmShape,
    lines: Float[np.ndarray, "rows capsules 2 3"],
    hulls: Sequence[Hull],
    *,
    looked_at: Bool[np.ndarray, " capsules"],
    far: float = FAR,
) -> Float[np.ndarray, " rows"]:
    """Least distance of some capsules from a hull in every row [m], where it may be below `far`.

    Args:
        arm: Whose capsules they are.
        lines: Where they are.
        hulls: One for all rows, or one for each.
        looked_at: Which capsules count.
        far: Greatest distance of interest [m].
    """
    corners = np.stack([hull.corners for hull in hulls]) if len(hulls) else np.zeros((0, 8, 3))
    gaps = _at_least(lines, corners) - arm.radii
    result = np.full(len(lines), far)
    near = (gaps < far) & looked_at
    for row, capsule in zip(*np.nonzero(near), strict=True):
        if gaps[row, capsule] < result[row]:
            hull = hulls[row if len(hulls) > 1 else 0]
            distance = _distance(lines[row, capsule], arm.radii[capsule], hull)
            result[row] = min(result[row], distance)
    return result


def _at_least(
    lines: Float[np.ndarray, "rows capsules 2 3"], corners: Float[np.ndarray, "hulls 8 3"]
) -> Float[np.ndarray, "rows capsules"]:
    """Lower bounds of the lines' distances: from a sphere about the hull, and beyond each of its faces."""
    centre = corners.mean(1)
    size = np.linalg.norm(corners - centre[:, None], axis=2).max(1)
    start, way = lines[:, :, 0], lines[:, :, 1] - lines[:, :, 0]
    square = np.maximum((way**2).sum(-1), 1e-30)
    share = np.clip(((centre[:, None] - start) * way).sum(-1) / square, 0.0, 1.0)
    ball = np.linalg.norm(start + share[..., None] * way - centre[:, None], axis=-1) - size[:, None]
    faces = corners[:, FACES]
    normals = np.cross(faces[:, :, 2] - faces[:, :, 0], faces[:, :, 3] - faces[:, :, 1])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    offsets = (normals * faces[:, :, 0]).sum(-1)
    beyond = lines @ np.swapaxes(normals, 1, 2)[:, None] - offsets[:, None, None]
    return np.maximum(ball, beyond.min(2).max(-1))


_STILL = coal.Transform3s()
_REQUEST = coal.DistanceRequest()


def _distance(line: Float[np.ndarray, "2 3"], radius: float, hull: Hull) -> float:
    way = line[1] - line[0]
    length = float(np.linalg.norm(way))
    pose = coal.Transform3s()
    if length > 1e-9:
        pose.setRotation(_upright(way / length))
    pose.setTranslation(0.5 * (line[0] + line[1]))
    capsule = coal.Capsule(float(radius), length)
    return float(coal.distance(capsule, pose, hull.shape, _STILL, _REQUEST, coal.DistanceResult()))


def _upright(z: np.ndarray) -> np.ndarray:
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


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What an arm must keep clear of whatever the blocks are: the plate, the table, itself.

    Args:
        arm: The arm's capsules.
        plate: The plate's solid, if it has one.
        floor: Height of the table in the robot's base [m]; None if there is none.
    """

    arm: ArmShape
    plate: Hull | None
    floor: float | None

    def distances(
        self, lines: Float[np.ndarray, "rows capsules 2 3"], far: float = FAR
    ) -> Float[np.ndarray, "rows 3"]:
        """Least distance from itself, the table and the plate in every row [m], up to `far`."""
        arm = self.arm
        result = np.full((len(lines), 3), far)
        if len(arm.apart.pairs):
            result[:, 0] = np.minimum(arm.own_distances(lines).min(1), far)
        free = arm.bodies > ON_THE_TABLE
        if self.floor is not None and free.any():
            low = lines[..., 2][:, free].min(-1) - arm.radii[free]
            result[:, 1] = np.minimum(low.min(1) - self.floor, far)
        if self.plate is not None:
            every = np.ones(len(arm.radii), bool)
            result[:, 2] = hull_distances(arm, lines, [self.plate], looked_at=every, far=far)
        return result
