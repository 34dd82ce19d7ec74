"""Solids for the scene as plain vertices and faces: turned parts, tubes, target blocks.

Edges that should look sharp have their vertices twice, so that the browser does not smooth across them.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from workbench.base import se3
from workbench.base.types import Matrix4, Vector3

TURNED_CORNERS = 28
"""Corners of a turned part."""
BANDS = 8
"""Rings of faces of a ball."""
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles.

    Args:
        vertices: Corners [m].
        faces: Indices of each triangle's corners, anticlockwise from outside.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    def moved(self, pose: Matrix4) -> "Solid":
        return Solid(se3.apply(pose, self.vertices), self.faces)


def merged(solids: list[Solid]) -> Solid:
    starts = np.cumsum([0, *(len(s.vertices) for s in solids)])
    faces = [s.faces + start for s, start in zip(solids, starts, strict=False)]
    return Solid(np.concatenate([s.vertices for s in solids]), np.concatenate(faces))


def turned(*profiles: list[tuple[float, float]]) -> Solid:
    """A solid of revolution about z.

    Args:
        profiles: Runs of (radius, height) [m] from bottom to top, each smooth in itself, with a sharp edge
            between one and the next.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, TURNED_CORNERS, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], -1)
    parts = []
    for profile in profiles:
        radii, heights = np.array(profile, float).T
        rings = np.concatenate(
            [
                radii[:, None, None] * circle[None],
                np.broadcast_to(heights[:, None, None], (len(radii), TURNED_CORNERS, 1)),
            ],
            -1,
        )
        i, j = np.meshgrid(np.arange(len(radii) - 1), np.arange(TURNED_CORNERS), indexing="ij")
        a, b = i * TURNED_CORNERS + j, i * TURNED_CORNERS + (j + 1) % TURNED_CORNERS
        c, d = b + TURNED_CORNERS, a + TURNED_CORNERS
        faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
        parts.append(Solid(rings.reshape(-1, 3), faces))
    return merged(parts)


def cylinder(radius: float, low: float, high: float, *, bevel: float = 0.0) -> Solid:
    """A cylinder about z with bevelled edges."""
    inner = radius - bevel
    return turned(
        [(0.0, low), (inner, low)],
        [(inner, low), (radius, low + bevel)],
        [(radius, low + bevel), (radius, high - bevel)],
        [(radius, high - bevel), (inner, high)],
        [(inner, high), (0.0, high)],
    )


def ball(radius: float, centre: Vector3) -> Solid:
    profile = [(radius * np.sin(a), -radius * np.cos(a)) for a in np.linspace(0.0, np.pi, BANDS + 1)]
    return turned(profile).moved(se3.pose(np.eye(3), centre))


def along(direction: Vector3, origin: Vector3) -> Matrix4:
    """A pose at the origin whose z axis points along the direction."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(UP if abs(z[2]) < 0.9 else np.array([1.0, 0.0, 0.0]), z)
    x /= np.linalg.norm(x)
    return se3.pose(np.stack([x, np.cross(z, x), z], -1), origin)


def tube(start: Vector3, end: Vector3, radius: float, end_radius: float | None = None) -> Solid:
    """An open tube or cone from one point to another."""
    length = float(np.linalg.norm(end - start))
    profile = [(radius, 0.0), (radius if end_radius is None else end_radius, length)]
    return turned(profile).moved(along(end - start, start))


def box(size: Vector3) -> Solid:
    """A box whose top face is centred at the origin."""
    square = 0.5 * size[:2] * _CORNERS
    heights = np.repeat([-size[2], 0.0], 4)
    return Solid(np.column_stack([np.tile(square, (2, 1)), heights]), _FACES)


SIDE = 0.046
"""Side of a target block [m]."""
STEEPEST = 0.35
"""Minimum share of the face's normal along the plate's normal for a block that stands on the plate."""
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]
    + [f for i in range(4) for f in ([i, (i + 1) % 4, 4 + (i + 1) % 4], [i, 4 + (i + 1) % 4, 4 + i])]
)


def target_block(pose: Matrix4, plate: Matrix4) -> Solid:
    """A truncated square prism whose upper face is where the tool sits (ARIA Fig. 6b).

    It stands on the plate, cut off in the plane of the target; where that plane is too steep, or below the
    plate, it is a free block behind the target's face.

    Args:
        pose: Pose of the tool at the target, whose z axis points into the face, robot's base.
        plate: Pose of the plate's top centre, robot's base.
    """
    local = se3.inverse(plate) @ pose
    normal, place = -local[:3, 2], local[:3, 3]
    half = 0.5 * SIDE * _CORNERS
    if normal[2] > STEEPEST:
        top = np.column_stack([half, -(half @ normal[:2]) / normal[2]]) + place
        bottom = np.column_stack([1.12 * half + place[:2], np.zeros(4)])
        if top[:, 2].min() > 0.0:
            return Solid(np.concatenate([bottom, top]), _FACES).moved(plate)
    top = np.column_stack([half * [1.0, -1.0], np.zeros(4)])
    bottom = np.column_stack([1.12 * half * [1.0, -1.0], np.full(4, 0.6 * SIDE)])
    return Solid(np.concatenate([bottom, top]), _FACES).moved(pose)


def cuboid_edges(
    low: Vector3, high: Vector3, cubes: tuple[int, int, int] = (1, 1, 1)
) -> Float[np.ndarray, "edges 2 3"]:
    """The edges of a cuboid along the axes, and on its sides those of so many cubes along each."""
    edges = []
    for axis, (b, c) in enumerate(((1, 2), (0, 2), (0, 1))):
        for i, j in np.ndindex(cubes[b] + 1, cubes[c] + 1):
            if i in (0, cubes[b]) or j in (0, cubes[c]):
                place = np.zeros((2, 3))
                place[:, b], place[:, c], place[1, axis] = i / cubes[b], j / cubes[c], 1.0
                edges.append(place)
    return low + np.array(edges) * (high - low)
