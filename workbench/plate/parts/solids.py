"""The parts as closed triangle meshes in millimetres, and the mesh files STL and 3MF.

A round hole becomes a polygon of the circle's area, so that a mesh has the volume of its part exactly; with
96 corners its radius is off by 0.04 %.
"""

from typing import Any

import numpy as np
import trimesh

from workbench.base.errors import MissingExtraError
from workbench.base.types import Matrix4, Vector3
from workbench.plate.parts.parts import Block, Bore, Fixture, Slab

AROUND = 96
"""Corners of a round hole."""
BEYOND = 1.0
"""How far cutters stand out of the material [mm]."""
MM = 1e3


def slab_mesh(slab: Slab) -> trimesh.Trimesh:
    """The plate as a mesh [mm], its top at z = 0."""
    manifold = _manifold()
    body = manifold.cube((MM * slab.size).tolist(), True).translate((0.0, 0.0, -0.5 * MM * slab.size[2]))
    return _drilled(body, slab.bores)


def block_mesh(block: Block) -> trimesh.Trimesh:
    """A block as a mesh [mm] in its own frame."""
    side, height, rise = MM * block.side, MM * block.height, float(np.tan(block.tilt))
    bar = _manifold().cube((side, side, height + side * rise), True)
    bar = bar.translate((0.0, 0.0, 0.5 * (height + side * rise)))
    below = np.array([-np.sin(block.tilt), 0.0, -np.cos(block.tilt)])
    return _drilled(bar.trim_by_plane(below.tolist(), -height * float(np.cos(block.tilt))), block.bores)


def stl(mesh: trimesh.Trimesh) -> bytes:
    """A binary STL file."""
    return _bytes(mesh.export(file_type="stl"))


def three_mf(fixture: Fixture) -> bytes:
    """A 3MF file of the whole fixture: the plate and every block in its place, each an object by name."""
    scene = trimesh.Scene()
    scene.units = "millimeter"
    scene.add_geometry(slab_mesh(fixture.slab), node_name="plate", geom_name="plate")
    for block in fixture.blocks:
        name = f"block {block.number}"
        placed = block_mesh(block)
        placed.apply_transform(_millimetres(block.pose))
        scene.add_geometry(placed, node_name=name, geom_name=name)
    return _bytes(scene.export(file_type="3mf"))


def _bytes(content: Any) -> bytes:
    """What the library writes for binary formats."""
    return bytes(content)


def _millimetres(pose: Matrix4) -> np.ndarray:
    scaled = pose.copy()
    scaled[:3, 3] *= MM
    return scaled


def _drilled(body: Any, bores: tuple[Bore, ...]) -> trimesh.Trimesh:
    """The body without its bores."""
    manifold = _manifold()
    result = body - manifold.batch_boolean([_cutter(bore) for bore in bores], _add())
    mesh = result.to_mesh64()
    return trimesh.Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts), process=False)


def _cutter(bore: Bore) -> Any:
    """What a bore takes away, standing a little out of its mouth, and out of its end if it goes through."""
    equal_area = np.sqrt(2.0 * np.pi / (AROUND * np.sin(2.0 * np.pi / AROUND)))
    radius, depth = 0.5 * MM * bore.diameter, MM * bore.depth
    mouth = radius * (1.0 + BEYOND / depth) if bore.conical else radius
    end = 0.0 if bore.conical else radius
    depth += BEYOND * bore.through
    tool = _manifold().cylinder(depth + BEYOND, mouth * equal_area, end * equal_area, AROUND)
    frame = np.column_stack([_turned_to(bore.direction), MM * bore.mouth])
    return tool.translate((0.0, 0.0, -BEYOND)).transform(frame.tolist())


def _turned_to(direction: Vector3) -> np.ndarray:
    """A rotation whose z axis is the direction."""
    x = np.cross([0.0, 1.0, 0.0], direction)
    if np.linalg.norm(x) < 0.1:
        x = np.cross([1.0, 0.0, 0.0], direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])


def _manifold() -> Any:
    """The library's class of solids.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        from manifold3d import Manifold
    except ImportError:
        raise MissingExtraError("writing STL and 3MF solids", extra="cad") from None
    return Manifold


def _add() -> Any:
    from manifold3d import OpType

    return OpType.Add
