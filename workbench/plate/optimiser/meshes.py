"""An arm as the meshes of its URDF, for clearance that holds on the real machine.

Pinocchio reads the file's collision geometry (the visual one where there is none): meshes and primitives with
their scales and placements, as coal bodies. Their frames come from the arm's own chain rather than from
Pinocchio's model, since the chain has the calibrated corrections, computes all postures at once, and is what
everything else is computed with. Capsules (`capsules`) remain for arms that come as tables.

Every piece also has its convex hull and a capsule about it, and hull ⊇ mesh, capsule ⊇ mesh. Distances of
capsules spare most pairs in one compiled pass over all postures, distances of hulls (GJK) most of the others;
only what is left is measured by the triangles' bounding volume hierarchy, which takes a hundred times as
long. What is measured is exact for the triangles; where bodies overlap it is 0 for meshes and negative for
convex bodies.

Neighbouring bodies are never checked against each other. Neither are two bodies that no posture brings apart
by more than the clearance that is asked for, such as links beside the one joint that connects them.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import final

import coal
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull

from workbench.arm.kinematics.forward import link_frames
from workbench.arm.meshes import find_mesh
from workbench.arm.motion import Motion
from workbench.arm.robot import JointKind, Robot
from workbench.arm.urdf_source import UrdfSource
from workbench.base import se3
from workbench.base.types import frozen
from workbench.plate.optimiser.capsules import LAST_LINK_RADIUS, PROBE_RADIUS
from workbench.plate.optimiser.segments import segment_distances
from workbench.plate.optimiser.shapes import (
    MAX_MEASURED_DISTANCE,
    AbstractArmShape,
    Hull,
    Placements,
    convex,
    line_distances,
    turned_to,
)

SAMPLED = 200
"""Random postures that tell which pairs of bodies can be apart."""
AROUND = 64
"""Corners of the polygon about a cylinder."""
AT_THE_TOOL = 0.005
"""A body of the last link that comes this near to the tool's origin is the probe [m]."""


@dataclass(frozen=True, eq=False)
class Piece:
    """One body of a link.

    Args:
        entry: Frame that it is fixed to: 0 for the base's, i + 1 for the link after joint entry i.
        body: 0 for the base, k for the link after moving joint k.
        pose: Of the shape in that frame.
        shape: As the file has it.
        hull: A convex body about it, the shape itself where that is convex.
        corners: Points in the shape's frame whose convex hull, widened by the margin, is that hull [m].
        margin: Radius of spheres and capsules, 0 for others [m].
        probe: Whether it may touch the block that it visits.
    """

    entry: int
    body: int
    pose: Float[np.ndarray, "4 4"]
    shape: coal.CollisionGeometry
    hull: coal.CollisionGeometry
    corners: Float[np.ndarray, "corners 3"]
    margin: float = 0.0
    probe: bool = False

    @cached_property
    def capsule(self) -> tuple[Float[np.ndarray, "2 3"], float]:
        """Line in the shape's frame, and radius, of a capsule about the piece [m]."""
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
        return centre + np.array([start, end])[:, None] * axis, radius + self.margin


@final
@dataclass(frozen=True, eq=False)
class MeshArm(AbstractArmShape):
    """An arm's meshes.

    Args:
        pieces: In order from base to tool.
        pairs: Pieces that must not touch.
        source: What they are, as a sentence.
    """

    robot: Robot
    pieces: tuple[Piece, ...]
    pairs: Int[np.ndarray, "pairs 2"]
    source: str

    @cached_property
    def bodies(self) -> Int[np.ndarray, " pieces"]:
        return np.array([piece.body for piece in self.pieces])

    @cached_property
    def probes(self) -> Bool[np.ndarray, " pieces"]:
        return np.array([piece.probe for piece in self.pieces])

    @cached_property
    def radii(self) -> Float[np.ndarray, " pieces"]:
        """Radius of the capsule about each piece [m]."""
        return np.array([piece.capsule[1] for piece in self.pieces])

    def placements(self, q: Float[np.ndarray, "rows n"]) -> Float[np.ndarray, "rows pieces 4 4"]:
        """Frames of the pieces in the robot's base."""
        frames = se3.inverse(self.robot.base.pose) @ link_frames(self.robot, Motion(q))
        poses = np.stack([piece.pose for piece in self.pieces])
        return frames[:, [piece.entry for piece in self.pieces]] @ poses

    def lowest(self, placements: Float[np.ndarray, "rows pieces 4 4"]) -> Float[np.ndarray, "rows pieces"]:
        return np.stack(
            [
                (at[:, 2, :3] @ piece.corners.T).min(1) + at[:, 2, 3] - piece.margin
                for piece, at in zip(self.pieces, np.swapaxes(placements, 0, 1), strict=True)
            ],
            axis=1,
        )

    def own_distances(
        self, placements: Placements, *, far: float = MAX_MEASURED_DISTANCE, minimum: float | None = None
    ) -> Float[np.ndarray, " rows"]:
        result = np.full(len(placements), far)
        if not len(self.pairs):
            return result
        lines = self._lines(placements)
        one, other = self.pairs.T
        bounds = segment_distances(lines[:, one], lines[:, other]) - self.radii[self.pairs].sum(1)
        for row, pair in zip(*np.nonzero(bounds < far), strict=True):
            if bounds[row, pair] < result[row] and not _is_close(result[row], minimum):
                i, j = self.pairs[pair]
                first, second = self.pieces[i], self.pieces[j]
                places = _transform(placements[row, i]), _transform(placements[row, j])
                result[row] = _distance(first, places[0], second, places[1], float(result[row]), minimum)
        return result

    def hull_distances(
        self,
        placements: Placements,
        hulls: Sequence[Hull],
        *,
        checked: Bool[np.ndarray, " pieces"],
        far: float = MAX_MEASURED_DISTANCE,
        minimum: float | None = None,
    ) -> Float[np.ndarray, " rows"]:
        result = np.full(len(placements), far)
        bounds = line_distances(self._lines(placements), hulls, far + self.radii) - self.radii
        for row, i in zip(*np.nonzero((bounds < far) & checked), strict=True):
            if bounds[row, i] < result[row] and not _is_close(result[row], minimum):
                hull, place = hulls[row if len(hulls) > 1 else 0], _transform(placements[row, i])
                result[row] = _distance(self.pieces[i], place, hull, _STILL, float(result[row]), minimum)
        return result

    def _lines(self, placements: np.ndarray) -> Float[np.ndarray, "rows pieces 2 3"]:
        """Lines of the capsules about the pieces, robot's base [m]."""
        return se3.apply(placements[:, :, None], np.array([piece.capsule[0] for piece in self.pieces]))


def _is_close(distance: float, minimum: float | None) -> bool:
    """Whether no more need be known of a row: it is known to have less than the minimum."""
    return minimum is not None and distance < minimum


_STILL = coal.Transform3s()
_REQUEST = coal.DistanceRequest()


def _transform(pose: Float[np.ndarray, "4 4"]) -> coal.Transform3s:
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


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


def mesh_arm(robot: Robot, clearance: float) -> MeshArm | None:
    """The meshes of an arm's URDF; None if it has none, or if one of them can't be read.

    Args:
        clearance: Distance that will be asked for [m]; pairs that are never so far apart are left out.
    """
    if robot.urdf is None or not robot.urdf.path.is_file():
        return None
    try:
        pieces, kind = _pieces(robot, robot.urdf)
    except Exception:  # Pinocchio, its mesh reader and qhull raise many kinds for files that they can't use
        return None
    if not pieces:
        return None
    pieces = _with_probe(robot, pieces)
    pairs = [(i, j) for (i, a), (j, b) in combinations(enumerate(pieces), 2) if abs(a.body - b.body) > 1]
    source = f"clearance is that of the {kind} meshes of {robot.urdf.path.name}"
    every = MeshArm(robot, pieces, np.array(pairs, np.int64).reshape(-1, 2), source)
    low, high = robot.search_limits.T
    q = np.random.default_rng(0).uniform(low, high, (SAMPLED, robot.dof))
    placements = every.placements(q)
    separable = [
        _can_separate(replace(every, pairs=pair[None]), placements, clearance) for pair in every.pairs
    ]
    return replace(every, pairs=every.pairs[np.array(separable, bool)])


def _can_separate(arm: MeshArm, placements: np.ndarray, clearance: float) -> bool:
    """Whether some posture brings the arm's only pair apart by more than the clearance [m]."""
    far = clearance + 0.01
    return any(arm.own_distances(row[None], far=far, minimum=clearance)[0] > clearance for row in placements)


def _pieces(robot: Robot, source: UrdfSource) -> tuple[tuple[Piece, ...], str]:
    """Bodies of the chain's links, and whether they are the file's collision or visual ones."""
    import pinocchio as pin  # a second to import: only for arms with a URDF

    root = ET.parse(source.path).getroot()
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    links = [source.root, *(joints[name].find("child").get("link") for name in source.joints)]  # type: ignore[union-attr]
    kind = "visual"
    for link in root.findall("link"):
        if link.get("name") in links:
            kind = "collision" if link.find("collision") is not None else kind
        else:
            for shape in (*link.findall("collision"), *link.findall("visual")):
                link.remove(shape)
    for mesh in root.iter("mesh"):
        mesh.set("filename", find_mesh(str(mesh.get("filename")), source.path))
    text = ET.tostring(root, encoding="unicode")
    model = pin.buildModelFromXML(text)
    geometry = pin.buildGeomFromUrdfString(model, text, getattr(pin.GeometryType, kind.upper()))
    moving = np.cumsum([0, *(joint.kind is not JointKind.FIXED for joint in robot.joints)])
    pieces = []
    for found in geometry.geometryObjects:
        frame = model.frames[found.parentFrame]
        entry = links.index(frame.name)
        pose = (frame.placement.inverse() * found.placement).homogeneous
        pieces.append(_piece(entry, int(moving[entry]), pose, found.geometry))
    return tuple(sorted(pieces, key=lambda piece: piece.entry)), kind


def _piece(entry: int, body: int, pose: Float[np.ndarray, "4 4"], shape: coal.CollisionGeometry) -> Piece:
    corners, margin = _corners(shape)
    hull = convex(corners) if isinstance(shape, coal.BVHModelBase) else shape
    return Piece(entry, body, frozen(pose), shape, hull, frozen(corners), margin)


def _corners(shape: coal.CollisionGeometry) -> tuple[Float[np.ndarray, "corners 3"], float]:
    """Points, and the radius about them, whose convex hull is the shape's [m]; a cylinder's to 0.1 %."""
    match shape:
        case coal.BVHModelBase():
            points = np.array(shape.vertices())
            return points[ConvexHull(points).vertices], 0.0
        case coal.Box():
            return np.stack(np.meshgrid(*([-1.0, 1.0],) * 3), -1).reshape(-1, 3) * shape.halfSide, 0.0
        case coal.Cylinder():
            angles = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
            ring = shape.radius / np.cos(np.pi / AROUND) * np.stack([np.cos(angles), np.sin(angles)], -1)
            ends = [
                np.column_stack([ring, np.full(AROUND, h)]) for h in (-shape.halfLength, shape.halfLength)
            ]
            return np.concatenate(ends), 0.0
        case coal.Capsule():
            return np.array([[0.0, 0.0, -shape.halfLength], [0.0, 0.0, shape.halfLength]]), float(
                shape.radius
            )
        case coal.Sphere():
            return np.zeros((1, 3)), float(shape.radius)
    raise TypeError(type(shape).__name__)


def _with_probe(robot: Robot, pieces: tuple[Piece, ...]) -> tuple[Piece, ...]:
    """The pieces, the probe among them: what is at the tool's origin, or a slender rod to it."""
    frames = link_frames(robot, Motion(np.zeros((1, robot.dof))))[0]
    point, at_tool = coal.Sphere(1e-6), coal.Transform3s(np.eye(3), frames[-1, :3, 3])

    def touches(piece: Piece) -> bool:
        at = _transform(frames[piece.entry] @ piece.pose)
        gap = coal.distance(piece.hull, at, point, at_tool, _REQUEST, coal.DistanceResult())
        return piece.body == robot.dof and gap < AT_THE_TOOL

    marked = tuple(replace(piece, probe=touches(piece)) for piece in pieces)
    if any(piece.probe for piece in marked):
        return marked
    last = len(robot.joints)
    tip = (se3.inverse(frames[last]) @ frames[-1])[:3, 3]
    length, radius = float(np.linalg.norm(tip)), PROBE_RADIUS * LAST_LINK_RADIUS * robot.reach
    inside = max(length - radius, radius)
    along = tip / length if length > 0.0 else np.array([0.0, 0.0, 1.0])  # the tool is at the flange
    pose = se3.pose(turned_to(along), 0.5 * inside * along)
    return (*marked, replace(_piece(last, robot.dof, pose, coal.Capsule(radius, inside)), probe=True))
