"""The parts as triangle meshes in millimetres, for STL.

In a mesh a round hole becomes a polygon of the circle's area, so that a mesh has the volume of its part
exactly; with 96 corners its radius is off by 0.04 %.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.base.errors import MissingExtraError
from workbench.base.types import Vector3
from workbench.extras.workshop.parts import Block, Bore, Slab, Turned
from workbench.plate.optimiser.shapes import turned_to

if TYPE_CHECKING:
    from trimesh import Trimesh

Part = Slab | Block | Turned
HOLE_SIDES = 96
"""Corners of a round hole."""
OVERSHOOT = 1.0
"""How far cutting tools extend beyond the material [mm]."""
MM = 1e3


def mesh_of(part: Part) -> "Trimesh":
    """A part as a mesh [mm] in its own frame."""
    manifold = _manifold()
    if isinstance(part, Turned):
        widen = 0.5 * _equal_area()
        pieces = [
            manifold.cylinder(length, widen * diameter, widen * diameter, HOLE_SIDES).translate((0.0, 0.0, z))
            for z, diameter, length in cylinders(part)
        ]
        return _drilled(manifold.batch_boolean(pieces, _add()), part.bores)
    outline, width = prism(part)
    corners = [(x, y, z) for x, z in outline for y in (-0.5 * width, 0.5 * width)]
    return _drilled(manifold.hull_points(np.array(corners)), part.bores)


def prism(part: Slab | Block) -> tuple[list[tuple[float, float]], float]:
    """Outline in (x, z), and width along y [mm]: a slab's top is at z = 0, a block's foot."""
    if isinstance(part, Slab):
        length, width, thickness = (MM * part.size).tolist()
        return [(-length / 2, -thickness), (length / 2, -thickness), (length / 2, 0), (-length / 2, 0)], width
    half, (low, high) = 0.5 * MM * part.side, (MM * h for h in part.heights)
    return [(-half, 0.0), (half, 0.0), (half, low), (-half, high)], 2.0 * half


def cylinders(part: Turned) -> list[tuple[float, float, float]]:
    """Where each step begins, its diameter and its length, from z = 0 upwards [mm]."""
    starts = np.cumsum([0.0, *(length for _, length in part.steps)])
    return [(MM * float(z), MM * d, MM * length) for z, (d, length) in zip(starts, part.steps, strict=False)]


def stl(mesh: "Trimesh") -> bytes:
    """A binary STL file."""
    return bytes(mesh.export(file_type="stl"))  # type: ignore[arg-type]


def _drilled(body: Any, bores: tuple[Bore, ...]) -> "Trimesh":
    from trimesh import Trimesh

    manifold = _manifold()
    result = body - manifold.batch_boolean([_cutter(bore) for bore in bores], _add())
    mesh = result.to_mesh64()
    return Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts), process=False)


def _cutter(bore: Bore) -> Any:
    equal_area = _equal_area()
    start, mouth, end, length = cut(bore)
    tool = _manifold().cylinder(length, mouth * equal_area, end * equal_area, HOLE_SIDES)
    return tool.transform(np.column_stack([turned_to(bore.direction), start]).tolist())


def cut(bore: Bore) -> tuple[Vector3, float, float, float]:
    """What cuts a bore: where it begins, its radius there and at its end, and its length [mm].

    It stands a little out of the mouth, and out of the end if the bore goes through.
    """
    radius, depth = 0.5 * MM * bore.diameter, MM * bore.depth
    start = MM * bore.mouth - OVERSHOOT * bore.direction
    if bore.conical:
        return start, radius * (1.0 + OVERSHOOT / depth), 0.0, depth + OVERSHOOT
    return start, radius, radius, depth + OVERSHOOT * (1 + bore.through)


def _equal_area() -> float:
    """Radius of a polygon's corners by that of the circle of its area."""
    return float(np.sqrt(2.0 * np.pi / (HOLE_SIDES * np.sin(2.0 * np.pi / HOLE_SIDES))))


def _manifold() -> Any:
    """The library's class of solids."""
    try:
        from manifold3d import Manifold
    except ImportError:
        raise MissingExtraError("writing STL and 3MF solids", extra="cad") from None
    return Manifold


def _add() -> Any:
    from manifold3d import OpType

    return OpType.Add
