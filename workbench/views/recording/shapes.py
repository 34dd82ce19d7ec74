"""Solids and rotations in rerun's terms."""

import numpy as np
import rerun as rr

from workbench.base import se3
from workbench.views.appearance.shapes import Solid


def mesh(solid: Solid, colour: tuple[int, ...], *, flat: bool = False) -> rr.Mesh3D:
    """A solid of one colour.

    Args:
        solid: Its triangles.
        colour: Red, green, blue, and opacity if it is not solid, 0 to 255.
        flat: Whether its triangles are flat, not parts of a round body.
    """
    if flat:
        corners = solid.vertices[solid.faces].reshape(-1, 3)
        solid = Solid(corners, np.arange(len(corners)).reshape(-1, 3))
    return rr.Mesh3D(
        vertex_positions=solid.vertices,
        triangle_indices=solid.faces,
        vertex_normals=_normals(solid),
        albedo_factor=colour,
    )


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Rotations as rerun counts them: x, y, z, w."""
    return se3.matrix_to_quaternion(rotation)[..., [1, 2, 3, 0]]


def _normals(solid: Solid) -> np.ndarray:
    """Mean normal of the triangles about every corner, weighed by their size."""
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(solid.vertices)
    for k in range(3):
        np.add.at(normals, solid.faces[:, k], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
