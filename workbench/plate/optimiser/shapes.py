"""Collision shapes: convex hulls that stand still, and an arm as pieces that move with its links.

Every piece belongs to a body: 0 is the base, k the link after moving joint k. Neighbouring bodies touch by
design and are never checked against each other in full. The probe, at the end of the last body, alone may
touch the block of the target that it visits. Distances are in metres, in the robot's base.

Coal measures one pair of bodies at a time. Most pairs are spared this by lower bounds, computed for all
postures at once: every piece has a capsule about it, and a capsule's line is at least as far from a convex
body as from the sphere about it, and as both its ends are from the plane of any one face. Of what is left,
convex hulls (GJK) spare most meshes their triangles, which take a hundred times as long. What is measured is
exact; where bodies overlap it is 0 for meshes and negative for convex bodies.

Source of the distance of two segments: Ericson, Real-Time Collision Detection (2005), §5.1.9.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import final

import coal
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4, Vector3
from workbench.plate.optimiser.target_blocks import block_corners
from workbench.plate.plate import SQUARE, Plate

MAX_MEASURED_DISTANCE = 0.5
"""Distances above this are not measured [m]."""
ON_THE_TABLE = 1
"""Last body that may touch the table: the base's post and the link after the first joint."""
AROUND = 64
"""Corners of the polygon about a cylinder."""
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], *([i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4))])
"""Corners of the six faces of a hull, anticlockwise from outside."""
Placements = Float[np.ndarray, "rows frames 4 4"]
"""Frames of an arm's base and of the link after each joint entry, in the robot's base."""
Lines = Float[np.ndarray, "#rows #lines 2 3"]
"""Ends of segments in the robot's base [m]."""


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex body of six flat faces that stands still.

    Args:
        corners: Four of its foot and four of its top, anticlockwise from above, in the robot's base [m].
    """

    corners: Float[np.ndarray, "8 3"]

    @cached_property
    def shape(self) -> coal.ConvexBase:
        return convex(self.corners)

    @property
    def hull(self) -> coal.ConvexBase:
        return self.shape

    @cached_property
    def sphere(self) -> Float[np.ndarray, "4"]:
        """Centre and radius of a sphere about it [m]."""
        centre = self.corners.mean(0)
        return np.append(centre, np.linalg.norm(self.corners - centre, axis=1).max())

    @cached_property
    def planes(self) -> Float[np.ndarray, "4 6"]:
        """Outward normal of each face, and its distance from the origin along it [m]."""
        p, q, r, s = self.corners[FACES].transpose(1, 2, 0)
        normals = np.cross(r - p, s - q, axis=0)
        normals /= np.linalg.norm(normals, axis=0)
        return np.vstack([normals, (normals * p).sum(0)])


def convex(points: Float[np.ndarray, "points 3"]) -> coal.ConvexBase:
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


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of an arm.

    Args:
        body: 0 for the base, k for the link after moving joint k.
        frame: That it is fixed to: 0 for the base's, i + 1 for that after joint entry i.
        pose: Of the shape in that frame.
        shape: A mesh, box, cylinder, capsule or sphere.
        probe: Whether it may touch the block that it visits.
    """

    body: int
    frame: int
    pose: Matrix4
    shape: coal.CollisionGeometry
    probe: bool = False

    @cached_property
    def outline(self) -> tuple[Float[np.ndarray, "corners 3"], float]:
        """Points in the shape's frame, and the radius about them, whose convex hull is the shape's [m]; a
        cylinder's to 0.1 %."""
        match shape := self.shape:
            case coal.BVHModelBase():
                points = np.array(shape.vertices())
                return points[ConvexHull(points).vertices], 0.0
            case coal.Box():
                return np.array([*product((-1.0, 1.0), repeat=3)]) * shape.halfSide, 0.0
            case coal.Cylinder():
                angles = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
                ring = shape.radius / np.cos(np.pi / AROUND) * np.array([np.cos(angles), np.sin(angles)]).T
                high = np.full((AROUND, 1), shape.halfLength)
                return np.block([[ring, -high], [ring, high]]), 0.0
            case coal.Capsule():
                return np.outer([-shape.halfLength, shape.halfLength], [0.0, 0.0, 1.0]), shape.radius
            case coal.Sphere():
                return np.zeros((1, 3)), shape.radius
        raise TypeError(type(shape).__name__)

    @cached_property
    def hull(self) -> coal.CollisionGeometry:
        """A convex body about it, the shape itself where that is convex."""
        return convex(self.outline[0]) if isinstance(self.shape, coal.BVHModelBase) else self.shape

    @cached_property
    def corners(self) -> Float[np.ndarray, "corners 3"]:
        """Of its outline, in its frame [m]."""
        return se3.apply(self.pose, self.outline[0])

    @cached_property
    def capsule(self) -> tuple[Float[np.ndarray, "2 3"], float]:
        """Line in its frame, and radius, of a capsule about the piece [m]."""
        centre = self.corners.mean(0)
        local = self.corners - centre
        axis = np.linalg.svd(local, full_matrices=False)[2][0]
        along = local @ axis
        beside = np.linalg.norm(local - along[:, None] * axis, axis=1)
        radius = float(beside.max())
        room = np.sqrt(np.maximum(radius**2 - beside**2, 0.0))
        start, end = (along + room).min(), (along - room).max()
        if start > end:
            start = end = 0.5 * (start + end)
            radius = float(np.hypot(beside, along - start).max())
        return centre + np.array([start, end])[:, None] * axis, radius + self.outline[1]

    def placed(self, frames: Float[np.ndarray, "frames 4 4"]) -> coal.Transform3s:
        """Where its shape is, in the robot's base."""
        at = frames[self.frame] @ self.pose
        return coal.Transform3s(at[:3, :3], at[:3, 3])


@final
@dataclass(frozen=True, eq=False)
class ArmShape:
    """An arm's pieces, and their distances from each other, from hulls and from the table.

    Args:
        pieces: In order from base to tool.
        pairs: Those that must not touch, or parts of them.
        source: What they are, a sentence for the notes of a result.
    """

    robot: Robot
    pieces: tuple[Piece, ...]
    pairs: tuple[tuple[Piece, Piece], ...]
    source: str

    @cached_property
    def bodies(self) -> Int[np.ndarray, " pieces"]:
        """Body of each piece."""
        return np.array([piece.body for piece in self.pieces])

    @cached_property
    def probes(self) -> Bool[np.ndarray, " pieces"]:
        """Which pieces are the probe."""
        return np.array([piece.probe for piece in self.pieces])

    def placements(self, q: Float[np.ndarray, "rows n"]) -> Placements:
        """Where its links are at joint positions [rad or m]."""
        return se3.inverse(self.robot.base.pose) @ link_frames(self.robot, Motion(q))

    def lowest(self, frames: Placements) -> Float[np.ndarray, "rows pieces"]:
        """Height of the lowest point of each piece [m]."""
        heights = [
            (frames[:, p.frame, 2, :3] @ p.corners.T).min(1) + frames[:, p.frame, 2, 3] - p.outline[1]
            for p in self.pieces
        ]
        return np.stack(heights, axis=1)

    def own_distances(
        self, frames: Placements, *, far: float = MAX_MEASURED_DISTANCE, minimum: float | None = None
    ) -> Float[np.ndarray, " rows"]:
        """Minimum distance between pieces of the arm that must not touch, at most `far` [m].

        Args:
            far: Maximum distance of interest [m].
            minimum: Rows with a smaller distance than this may be given as 0 [m].
        """
        if not self.pairs:
            return np.full(len(frames), far)
        one, other = zip(*self.pairs, strict=True)
        gaps = segment_distances(_lines(frames, one), _lines(frames, other)) - _radii(one) - _radii(other)
        exact = np.array([all(isinstance(each.shape, coal.Capsule) for each in pair) for pair in self.pairs])
        result = np.minimum(gaps[:, exact].min(1, initial=far), far)
        for row, pair in zip(*np.nonzero((gaps < far) & ~exact), strict=True):
            if gaps[row, pair] < result[row] and not _is_close(result[row], minimum):
                first, second = self.pairs[pair]
                places = first.placed(frames[row]), second.placed(frames[row])
                result[row] = _distance(first, places[0], second, places[1], float(result[row]), minimum)
        return result

    def hull_distances(
        self,
        frames: Placements,
        hulls: Sequence[Hull],
        *,
        checked: Bool[np.ndarray, " pieces"],
        far: float = MAX_MEASURED_DISTANCE,
        minimum: float | None = None,
    ) -> Float[np.ndarray, " rows"]:
        """Minimum distance of some pieces from a hull in every row, at most `far` [m].

        Args:
            hulls: One for all rows, or one for each.
            checked: Which pieces count.
            far: Maximum distance of interest [m].
            minimum: As for `own_distances`.
        """
        result = np.full(len(frames), far)
        if not len(frames):
            return result
        bounds = hull_bounds(_lines(frames, self.pieces), hulls) - _radii(self.pieces)
        for row, i in zip(*np.nonzero((bounds < far) & checked), strict=True):
            if bounds[row, i] < result[row] and not _is_close(result[row], minimum):
                piece, hull = self.pieces[i], hulls[row if len(hulls) > 1 else 0]
                place = piece.placed(frames[row])
                result[row] = _distance(piece, place, hull, _STILL, float(result[row]), minimum)
        return result


def _lines(frames: Placements, pieces: Sequence[Piece]) -> Lines:
    """Lines of the capsules about pieces."""
    ends = np.array([piece.capsule[0] for piece in pieces])
    return se3.apply(frames[:, [piece.frame for piece in pieces], None], ends)


def _radii(pieces: Sequence[Piece]) -> Float[np.ndarray, " pieces"]:
    return np.array([piece.capsule[1] for piece in pieces])


def segment_distances(first: Lines, second: Lines) -> Float[np.ndarray, "rows lines"]:
    """Distance of each segment of the one from its partner among the other [m]."""
    start, begin = first[..., 0, :], second[..., 0, :]
    d1, d2, r = first[..., 1, :] - start, second[..., 1, :] - begin, start - begin
    a, b, c, e, f = (
        np.einsum("...i,...i", u, v) for u, v in ((d1, d1), (d1, d2), (d1, r), (d2, d2), (d2, r))
    )
    a_, e_ = np.maximum(a, _TINY), np.maximum(e, _TINY)  # points have no length
    across = a * e - b * b
    s = np.where(across > 1e-12 * a * e, (b * f - c * e) / np.maximum(across, _TINY), 0.0)
    t = np.clip((b * np.clip(s, 0.0, 1.0) + f) / e_, 0.0, 1.0)
    s = np.clip((b * t - c) / a_, 0.0, 1.0)
    return np.linalg.norm(r + s[..., None] * d1 - t[..., None] * d2, axis=-1)


def hull_bounds(lines: Lines, hulls: Sequence[Hull]) -> Float[np.ndarray, "rows lines"]:
    """Lower bounds of the distance of each line from the hull of its row, or the one of all [m]."""
    centres = np.stack([hull.sphere for hull in hulls])[:, None]
    planes = np.stack([hull.planes for hull in hulls])
    points = np.repeat(centres[..., None, :3], 2, axis=2)
    from_spheres = segment_distances(lines, points) - centres[..., 3]
    heights = lines.reshape(len(lines), -1, 3) @ planes[:, :3] - planes[:, 3:]
    from_faces = heights.reshape(*lines.shape[:3], 6).min(2).max(2)
    return np.maximum(from_spheres, from_faces)


_TINY = np.finfo(float).tiny
_STILL = coal.Transform3s()
_REQUEST = coal.DistanceRequest()


def _is_close(distance: float, minimum: float | None) -> bool:
    """Whether no more need be known of a row: it is known to have less than the minimum."""
    return minimum is not None and bool(distance < minimum)


def _distance(
    first: Piece,
    first_place: coal.Transform3s,
    second: Piece | Hull,
    second_place: coal.Transform3s,
    far: float,
    minimum: float | None,
) -> float:
    """Distance of two bodies, at most `far` [m]; 0 where it is below `minimum`."""
    bound = coal.distance(first.hull, first_place, second.hull, second_place, _REQUEST, coal.DistanceResult())
    if bound >= far or (first.hull is first.shape and second.hull is second.shape):
        return min(bound, far)
    if minimum is None:
        exact = coal.distance(
            first.shape, first_place, second.shape, second_place, _REQUEST, coal.DistanceResult()
        )
        return float(min(exact, far)) if exact > 0.0 else 0.0
    if bound >= minimum:
        return far
    request = coal.CollisionRequest()
    request.security_margin = minimum
    hit = coal.collide(first.shape, first_place, second.shape, second_place, request, coal.CollisionResult())
    return 0.0 if hit else far


def turned_to(direction: Vector3) -> Float[np.ndarray, "3 3"]:
    """A rotation whose z axis is the direction."""
    x = np.cross([0.0, 1.0, 0.0], direction)
    if np.linalg.norm(x) < 0.1:
        x = np.cross([1.0, 0.0, 0.0], direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
