"""Solids for the scene as plain vertices and faces: turned parts, tubes, target blocks.

Edges that should look sharp have their vertices twice, so that the browser does not smooth across them.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from workbench.base import se3
from workbench.base.types import Matrix4, Vector3
from workbench.plate.optimiser.target_blocks import block_corners
from workbench.plate.plate import SQUARE

TURNEDSQUARE = 28
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
    angles = np.linspace(0.0, 2.0 * np.pi, TURNEDSQUARE, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], -1)
    parts = []
    for profile in profiles:
        radii, heights = np.array(profile, float).T
        rings = np.concatenate(
            [
                radii[:, None, None] * circle[None],
                np.broadcast_to(heights[:, None, None], (len(radii), TURNEDSQUARE, 1)),
            ],
            -1,
        )
        i, j = np.meshgrid(np.arange(len(radii) - 1), np.arange(TURNEDSQUARE), indexing="ij")
        a, b = i * TURNEDSQUARE + j, i * TURNEDSQUARE + (j + 1) % TURNEDSQUARE
        c, d = b + TURNEDSQUARE, a + TURNEDSQUARE
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
    square = 0.5 * size[:2] * SQUARE
    heights = np.repeat([-size[2], 0.0], 4)
    return Solid(np.column_stack([np.tile(square, (2, 1)), heights]), _FACES)


_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]
    + [f for i in range(4) for f in ([i, (i + 1) % 4, 4 + (i + 1) % 4], [i, 4 + (i + 1) % 4, 4 + i])]
)


def target_block(pose: Matrix4, plate: Matrix4) -> Solid:
    """The block that is made, and that the arm must not touch, for the pose of a tool at a target on a plate
    (pose of its top centre, robot's base)."""
    return Solid(block_corners(plate, pose[None])[0], _FACES)


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
