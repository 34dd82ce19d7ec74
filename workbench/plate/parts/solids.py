"""The parts as solids in millimetres: triangle meshes for STL and 3MF, exact ones for STEP.

In a mesh a round hole becomes a polygon of the circle's area, so that a mesh has the volume of its part
exactly; with 96 corners its radius is off by 0.04 %. Exact solids come from OpenCascade (OCP), whose download
is large and optional.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from workbench.base.errors import FileError, MissingExtraError
from workbench.base.types import Matrix4, Vector3
from workbench.plate.parts.parts import Block, Bore, Fixture, Slab, Turned

Part = Slab | Block | Turned
AROUND = 96
"""Corners of a round hole."""
OVERSHOOT = 1.0
"""How far cutting tools extend beyond the material [mm]."""
MM = 1e3


def mesh_of(part: Part) -> trimesh.Trimesh:
    """A part as a mesh [mm] in its own frame."""
    match part:
        case Slab():
            return slab_mesh(part)
        case Block():
            return block_mesh(part)
    return turned_mesh(part)


def step_of(part: Part, name: str) -> bytes:
    """A part as a STEP file [mm] in its own frame."""
    match part:
        case Slab():
            return slab_step(part, name)
        case Block():
            return block_step(part, name)
    return turned_step(part, name)


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


def turned_mesh(part: Turned) -> trimesh.Trimesh:
    """A turned part as a mesh [mm], from z = 0 upwards."""
    manifold, z, pieces = _manifold(), 0.0, []
    for diameter, length in part.steps:
        radius = 0.5 * MM * diameter * _equal_area()
        pieces.append(manifold.cylinder(MM * length, radius, radius, AROUND).translate((0.0, 0.0, z)))
        z += MM * length
    return _drilled(manifold.batch_boolean(pieces, _add()), part.bores)


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
    equal_area = _equal_area()
    start, mouth, end, length = _cut(bore)
    tool = _manifold().cylinder(length, mouth * equal_area, end * equal_area, AROUND)
    return tool.transform(np.column_stack([_turned_to(bore.direction), start]).tolist())


def _cut(bore: Bore) -> tuple[Vector3, float, float, float]:
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
    return float(np.sqrt(2.0 * np.pi / (AROUND * np.sin(2.0 * np.pi / AROUND))))


def _turned_to(direction: Vector3) -> np.ndarray:
    """A rotation whose z axis is the direction."""
    x = np.cross([0.0, 1.0, 0.0], direction)
    if np.linalg.norm(x) < 0.1:
        x = np.cross([1.0, 0.0, 0.0], direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])


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


def slab_step(slab: Slab, name: str) -> bytes:
    """The plate as a STEP file [mm], its top at z = 0."""
    length, width, thickness = (MM * slab.size).tolist()
    outline = [(-length / 2, -thickness), (length / 2, -thickness), (length / 2, 0.0), (-length / 2, 0.0)]
    return _step_file(_solid(outline, width, slab.bores), name)


def block_step(block: Block, name: str) -> bytes:
    """A block as a STEP file [mm] in its own frame."""
    half, (low, high) = 0.5 * MM * block.side, (MM * h for h in block.heights)
    outline = [(-half, 0.0), (half, 0.0), (half, low), (-half, high)]
    return _step_file(_solid(outline, 2.0 * half, block.bores), name)


def turned_step(part: Turned, name: str) -> bytes:
    """A turned part as a STEP file [mm], from z = 0 upwards."""
    _require_step()
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    z, solid = 0.0, None
    for diameter, length in part.steps:
        axis = gp_Ax2(gp_Pnt(0.0, 0.0, z), gp_Dir(0.0, 0.0, 1.0))
        step = BRepPrimAPI_MakeCylinder(axis, 0.5 * MM * diameter, MM * length).Shape()
        solid = step if solid is None else BRepAlgoAPI_Fuse(solid, step).Shape()
        z += MM * length
    return _step_file(_less(solid, part.bores), name)


def _solid(outline: list[tuple[float, float]], width: float, bores: tuple[Bore, ...]) -> Any:
    """A prism along y over an outline in (x, z), less its bores [mm]."""
    _require_step()
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    polygon = BRepBuilderAPI_MakePolygon()
    for x, z in outline:
        polygon.Add(gp_Pnt(float(x), -0.5 * width, float(z)))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    return _less(BRepPrimAPI_MakePrism(face, gp_Vec(0.0, width, 0.0)).Shape(), bores)


def _less(solid: Any, bores: tuple[Bore, ...]) -> Any:
    """A solid without its bores."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    for bore in bores:
        solid = BRepAlgoAPI_Cut(solid, _step_cutter(bore)).Shape()
    return solid


def _step_cutter(bore: Bore) -> Any:
    """What a bore takes away."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    start, mouth, end, length = _cut(bore)
    axis = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*np.asarray(bore.direction).tolist()))
    if bore.conical:
        return BRepPrimAPI_MakeCone(axis, mouth, end, length).Shape()
    return BRepPrimAPI_MakeCylinder(axis, mouth, length).Shape()


def _step_file(solid: Any, name: str) -> bytes:
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.Interface import Interface_Static
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    for printer in list(Message.DefaultMessenger_s().Printers()):
        Message.DefaultMessenger_s().RemovePrinter(printer)
    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("write.step.product.name", name)
    Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer.Transfer(solid, STEPControl_AsIs)
    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        path = Path(folder) / "part.step"
        if writer.Write(str(path)) != IFSelect_RetDone:
            raise FileError("the STEP file can't be written; is the disk full?", path=str(path))
        return path.read_bytes()


def _require_step() -> None:
    """Refuse where the library is missing."""
    try:
        import OCP.STEPControl  # noqa: F401
    except ImportError:
        raise MissingExtraError("writing STEP files", extra="step") from None
