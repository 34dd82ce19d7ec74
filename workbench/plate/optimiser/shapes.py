"""Collision shapes: bodies that stand still, and an arm as pieces that move with its links.

Every piece belongs to a body: 0 is the base, k the link after moving joint k. Neighbouring bodies touch by
design and are never checked against each other in full. The probe, at the end of the last body, alone may
touch the block of the target that it visits. Distances are in metres, in the robot's base.

Coal measures one pair of solids at a time, 2 µs for convex ones; pairs whose spheres are farther apart than
what is asked for are spared this. Convex hulls (GJK) spare most meshes their triangles, which take a hundred
times as long. Where bodies overlap the distance is 0 for meshes and negative for convex bodies.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import final

import coal
import numpy as np
from jaxtyping import Bool, Float, Int

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.motion import Motion
from workbench.arm.robot import Robot
from workbench.base import se3
from workbench.base.types import Matrix4, Poses, Vector3
from workbench.plate.optimiser.target_blocks import block_corners
from workbench.plate.plate import SQUARE

ON_THE_TABLE = 1
"""Last body that may touch the table: the base's post and the link after the first joint."""
Placements = Float[np.ndarray, "rows frames 4 4"]
"""Frames of an arm's base and of the link after each joint entry, in the robot's base."""


@dataclass(frozen=True, eq=False)
class Collider:
    """A body in its own frame.

    Args:
        shape: A mesh, or a convex shape.
    """

    shape: coal.CollisionGeometry

    @cached_property
    def hull(self) -> coal.CollisionGeometry:
        """A convex body about it, the shape itself where that is convex."""
        return convex(self.shape.vertices()) if isinstance(self.shape, coal.BVHModelBase) else self.shape

    @cached_property
    def sphere(self) -> tuple[Vector3, float]:
        """Centre and radius of a sphere about it [m]."""
        if isinstance(self.shape, coal.Halfspace):
            return np.zeros(3), np.inf
        self.shape.computeLocalAABB()
        return np.array(self.shape.aabb_center), float(self.shape.aabb_radius)


def convex(points: Float[np.ndarray, "points 3"]) -> coal.ConvexBase:
    listed = coal.StdVec_Vec3s()
    for point in points:
        listed.append(np.asarray(point, float))
    return coal.Convex.convexHull(listed, True, "Qt")


def plate_hull(place: Matrix4, size: Vector3) -> Collider:
    """The solid of a plate of some size [m] at a place (robot's base)."""
    square = 0.5 * size[:2] * SQUARE
    layers = [np.column_stack([square, np.full(4, height)]) for height in (-size[2], 0.0)]
    return Collider(convex(se3.apply(place, np.concatenate(layers))))


def block_hulls(place: Matrix4, poses: Poses) -> list[Collider]:
    """The blocks of targets at poses, on a plate at a place (robot's base)."""
    return [Collider(convex(corners)) for corners in block_corners(place, poses)]


def below(height: float) -> Collider:
    """Everything below a height."""
    return Collider(coal.Halfspace(np.array([0.0, 0.0, 1.0]), float(height)))


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of an arm.

    Args:
        body: 0 for the base, k for the link after moving joint k.
        frame: That it is fixed to: 0 for the base's, i + 1 for that after joint entry i.
        pose: Of the solid in that frame.
        probe: Whether it may touch the block that it visits.
    """

    body: int
    frame: int
    pose: Matrix4
    solid: Collider
    probe: bool = False


@final
@dataclass(frozen=True, eq=False)
class ArmShape:
    """An arm's pieces, and their distances from each other and from solids that stand still.

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

    def kept_from(self, hull: Collider) -> Bool[np.ndarray, " pieces"]:
        """The pieces that must not touch a body that stands still: the base stands on the table."""
        return self.bodies > (ON_THE_TABLE if isinstance(hull.shape, coal.Halfspace) else -1)

    def lowest(self, frames: Placements) -> Float[np.ndarray, "rows pieces"]:
        """Height of the lowest point of each piece [m]."""
        one = np.eye(len(self.pieces), dtype=bool)
        return np.stack([self.hull_distances(frames, [below(0.0)], checked=k) for k in one], 1)

    def own_distances(self, frames: Placements, *, minimum: float = np.inf) -> Float[np.ndarray, " rows"]:
        """Minimum distance between pieces of the arm that must not touch [m]; infinite where there are none.

        Args:
            minimum: Rows with this distance are given as it, others as any smaller number [m]; infinite: all
                are measured.
        """
        if not self.pairs:
            return np.full(len(frames), minimum)
        (one, from_one, radii), (other, from_other, sizes) = (
            _placed(frames, side) for side in zip(*self.pairs, strict=True)
        )
        gaps = np.linalg.norm(from_one - from_other, axis=2) - radii - sizes

        def distance(row: int, k: int, far: float) -> float:
            first, second = self.pairs[k]
            places = _transform(one[row, k]), _transform(other[row, k])
            return _distance(first.solid, second.solid, places, far, minimum)

        return _nearest(gaps, distance, minimum)

    def hull_distances(
        self,
        frames: Placements,
        hulls: Sequence[Collider],
        *,
        checked: Bool[np.ndarray, "*rows pieces"],
        minimum: float = np.inf,
    ) -> Float[np.ndarray, " rows"]:
        """Minimum distance of some pieces from a solid that stands still in every row [m].

        Args:
            hulls: One for all rows, or one for each.
            checked: Which pieces count, in all rows or in each.
            minimum: As for `own_distances`.
        """
        if not len(frames):
            return np.zeros(0)
        at, centres, radii = _placed(frames, self.pieces)
        middles, sizes = (np.array(part) for part in zip(*(hull.sphere for hull in hulls), strict=True))
        gaps = np.linalg.norm(centres - middles[:, None], axis=2) - radii - sizes[:, None]

        def distance(row: int, i: int, far: float) -> float:
            hull = hulls[row if len(hulls) > 1 else 0]
            return _distance(self.pieces[i].solid, hull, (_transform(at[row, i]), _STILL), far, minimum)

        return _nearest(np.where(checked, gaps, np.inf), distance, minimum)

    def clearances(
        self,
        frames: Placements,
        *,
        solid: Collider | None = None,
        floor: float | None = None,
        minimum: float = np.inf,
    ) -> Float[np.ndarray, "rows 3"]:
        """Minimum distance from itself, the table and a solid in every row [m]; infinite without one.

        Args:
            solid: The plate's, if it has one.
            floor: Height of the table in the robot's base [m]; None if there is none.
            minimum: As for `own_distances`.
        """
        result = np.full((len(frames), 3), minimum)
        result[:, 0] = self.own_distances(frames, minimum=minimum)
        for column, hull in enumerate((None if floor is None else below(floor), solid), start=1):
            if hull is not None:
                checked = self.kept_from(hull)
                result[:, column] = self.hull_distances(frames, [hull], checked=checked, minimum=minimum)
        return result


def _placed(
    frames: Placements, pieces: Sequence[Piece]
) -> tuple[Float[np.ndarray, "rows pieces 4 4"], Float[np.ndarray, "rows pieces 3"], np.ndarray]:
    """Poses of pieces, and centres and radii of the spheres about them."""
    at = frames[:, [piece.frame for piece in pieces]] @ np.stack([piece.pose for piece in pieces])
    centres, radii = (np.array(part) for part in zip(*(piece.solid.sphere for piece in pieces), strict=True))
    return at, se3.apply(at, centres), radii


def _nearest(
    gaps: Float[np.ndarray, "rows pairs"], distance: Callable[[int, int, float], float], minimum: float
) -> Float[np.ndarray, " rows"]:
    """Minimum of the pairs' distances in every row [m].

    Args:
        gaps: Lower bounds of the distances [m].
        distance: Of a pair in a row, at most some `far`.
        minimum: As for `ArmShape.own_distances`.
    """
    result = np.full(len(gaps), minimum)
    for row in np.flatnonzero(gaps.min(1, initial=np.inf) < result).tolist():
        for pair in np.argsort(gaps[row]).tolist():
            if gaps[row, pair] >= result[row] or result[row] < minimum < np.inf:
                break
            result[row] = distance(row, pair, float(result[row]))
    return result


_STILL = coal.Transform3s()
_REQUEST = coal.DistanceRequest()


def _transform(pose: Matrix4) -> coal.Transform3s:
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


def _distance(
    first: Collider,
    second: Collider,
    places: tuple[coal.Transform3s, coal.Transform3s],
    far: float,
    minimum: float,
) -> float:
    """Distance of two bodies at their places, at most `far` [m]; 0 where it is below `minimum`."""

    def measured(one: coal.CollisionGeometry, other: coal.CollisionGeometry) -> float:
        return min(coal.distance(one, places[0], other, places[1], _REQUEST, coal.DistanceResult()), far)

    bound = measured(first.hull, second.hull)
    are_convex = first.hull is first.shape and second.hull is second.shape
    if bound >= far or are_convex or isinstance(second.shape, coal.Halfspace):
        return bound
    if minimum == np.inf:
        return max(measured(first.shape, second.shape), 0.0)
    if bound >= minimum:
        return far
    request = coal.CollisionRequest()
    request.security_margin = minimum
    hit = coal.collide(first.shape, places[0], second.shape, places[1], request, coal.CollisionResult())
    return 0.0 if hit else far


def turned_to(direction: Vector3) -> Float[np.ndarray, "3 3"]:
    """A rotation whose z axis is the direction."""
    x = np.cross([0.0, 1.0, 0.0], direction)
    if np.linalg.norm(x) < 0.1:
        x = np.cross([1.0, 0.0, 0.0], direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
