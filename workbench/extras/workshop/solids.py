"""The parts as solids in millimetres, meshes for STL by manifold3d.

In a mesh a circle becomes a polygon of its area, so that the mesh has the volume of its part exactly; with 96
corners its radius is off by 0.04 %.
"""

from typing import Any

import numpy as np

from workbench.base.errors import MissingExtraError
from workbench.base.types import Vector3
from workbench.extras.workshop.parts import Block, Bore, Slab
from workbench.plate.optimiser.shapes import turned_to
from workbench.plate.optimiser.target_blocks import SIDE

Part = Slab | Block
CORNERS = 96
"""Of a circle."""
EQUAL_AREA = float(np.sqrt(2.0 * np.pi / (CORNERS * np.sin(2.0 * np.pi / CORNERS))))
"""Radius of its corners by its own."""
OVERSHOOT = 1.0
"""How far cutting tools extend beyond the material [mm]."""
MM = 1e3


def stl_of(part: Part) -> bytes:
    """A binary STL file of a part in its own frame."""
    try:
        from manifold3d import Manifold, OpType
    except ImportError:
        raise MissingExtraError("writing STL solids", extra="cad") from None
    from trimesh import Trimesh

    def cutter(bore: Bore) -> Any:
        start, mouth, end, length = _cut(bore)
        placed = np.column_stack([turned_to(bore.direction), start])
        cylinder = Manifold.cylinder(length, mouth * EQUAL_AREA, end * EQUAL_AREA, CORNERS)
        return cylinder.transform(placed.tolist())

    outline, width = _prism(part)
    corners = [(x, y, z) for x, z in outline for y in (-0.5 * width, 0.5 * width)]
    solid = Manifold.hull_points(np.array(corners))
    solid -= Manifold.batch_boolean([cutter(bore) for bore in part.bores], OpType.Add)
    mesh = solid.to_mesh64()
    found = Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts), process=False)
    return bytes(found.export(file_type="stl"))  # type: ignore[arg-type]


def _prism(part: Slab | Block) -> tuple[list[tuple[float, float]], float]:
    """Outline in (x, z), and width along y [mm]: a slab's top is at z = 0, a block's foot."""
    if isinstance(part, Slab):
        length, width, thickness = (MM * part.size).tolist()
        return [(-length / 2, -thickness), (length / 2, -thickness), (length / 2, 0), (-length / 2, 0)], width
    half, (low, high) = 0.5 * MM * SIDE, (MM * h for h in part.heights)
    return [(-half, 0.0), (half, 0.0), (half, low), (-half, high)], 2.0 * half


def _cut(bore: Bore) -> tuple[Vector3, float, float, float]:
    """What cuts a bore: where it begins, its radius there and at its end, and its length [mm].

    It stands a little out of the mouth, and out of the end if the bore goes through.
    """
    radius, depth = 0.5 * MM * bore.diameter, MM * bore.depth
    start = MM * bore.mouth - OVERSHOOT * bore.direction
    if bore.conical:
        return start, radius * (1.0 + OVERSHOOT / depth), 0.0, depth + OVERSHOOT
    return start, radius, radius, depth + OVERSHOOT * (1 + bore.through)
