"""The parts as solids in millimetres: triangle meshes for STL and 3MF, exact ones for STEP.

In a mesh a round hole becomes a polygon of the circle's area, so that a mesh has the volume of its part
exactly; with 96 corners its radius is off by 0.04 %. Exact solids come from OpenCascade (OCP), whose download
is large and optional.
"""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.base.errors import FileError, MissingExtraError
from workbench.base.types import Matrix4, Vector3
from workbench.plate.optimiser.shapes import turned_to
from workbench.plate.parts.parts import Block, Bore, Fixture, Slab, Turned

if TYPE_CHECKING:
    from trimesh import Trimesh

Part = Slab | Block | Turned
AROUND = 96
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
            manifold.cylinder(length, widen * diameter, widen * diameter, AROUND).translate((0.0, 0.0, z))
            for z, diameter, length in _cylinders(part)
        ]
        return _drilled(manifold.batch_boolean(pieces, _add()), part.bores)
    outline, width = _prism(part)
    corners = [(x, y, z) for x, z in outline for y in (-0.5 * width, 0.5 * width)]
    return _drilled(manifold.hull_points(np.array(corners)), part.bores)


def step_of(part: Part, name: str) -> bytes:
    """A part as a STEP file [mm] in its own frame."""
    _require_step()
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec

    solid: Any = None
    if isinstance(part, Turned):
        for z, diameter, length in _cylinders(part):
            axis = gp_Ax2(gp_Pnt(0.0, 0.0, z), gp_Dir(0.0, 0.0, 1.0))
            step = BRepPrimAPI_MakeCylinder(axis, 0.5 * diameter, length).Shape()
            solid = step if solid is None else BRepAlgoAPI_Fuse(solid, step).Shape()
    else:
        outline, width = _prism(part)
        polygon = BRepBuilderAPI_MakePolygon()
        for x, z in outline:
            polygon.Add(gp_Pnt(float(x), -0.5 * width, float(z)))
        polygon.Close()
        face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
        solid = BRepPrimAPI_MakePrism(face, gp_Vec(0.0, width, 0.0)).Shape()
    for bore in part.bores:
        solid = BRepAlgoAPI_Cut(solid, _step_cutter(bore)).Shape()
    return _step_file(solid, name)


def _prism(part: Slab | Block) -> tuple[list[tuple[float, float]], float]:
    """Outline in (x, z), and width along y [mm]: a slab's top is at z = 0, a block's foot."""
    if isinstance(part, Slab):
        length, width, thickness = (MM * part.size).tolist()
        return [(-length / 2, -thickness), (length / 2, -thickness), (length / 2, 0), (-length / 2, 0)], width
    half, (low, high) = 0.5 * MM * part.side, (MM * h for h in part.heights)
    return [(-half, 0.0), (half, 0.0), (half, low), (-half, high)], 2.0 * half


def _cylinders(part: Turned) -> list[tuple[float, float, float]]:
    """Where each step begins, its diameter and its length, from z = 0 upwards [mm]."""
    starts = np.cumsum([0.0, *(length for _, length in part.steps)])
    return [(MM * float(z), MM * d, MM * length) for z, (d, length) in zip(starts, part.steps, strict=False)]


def stl(mesh: "Trimesh") -> bytes:
    """A binary STL file."""
    return bytes(mesh.export(file_type="stl"))  # type: ignore[arg-type]


def three_mf(fixture: Fixture) -> bytes:
    """A 3MF file of the whole fixture: the plate and every block in its place, each an object by name."""
    from trimesh import Scene

    scene = Scene()
    scene.units = "millimeter"
    scene.add_geometry(mesh_of(fixture.slab), node_name="plate", geom_name="plate")
    for block in fixture.blocks:
        name = f"block {block.number}"
        placed = mesh_of(block)
        placed.apply_transform(_millimetres(block.pose))
        scene.add_geometry(placed, node_name=name, geom_name=name)
    return bytes(scene.export(file_type="3mf"))  # type: ignore[arg-type]


def _millimetres(pose: Matrix4) -> np.ndarray:
    scaled = pose.copy()
    scaled[:3, 3] *= MM
    return scaled


def _drilled(body: Any, bores: tuple[Bore, ...]) -> "Trimesh":
    """The body without its bores."""
    from trimesh import Trimesh

    manifold = _manifold()
    result = body - manifold.batch_boolean([_cutter(bore) for bore in bores], _add())
    mesh = result.to_mesh64()
    return Trimesh(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts), process=False)


def _cutter(bore: Bore) -> Any:
    equal_area = _equal_area()
    start, mouth, end, length = _cut(bore)
    tool = _manifold().cylinder(length, mouth * equal_area, end * equal_area, AROUND)
    return tool.transform(np.column_stack([turned_to(bore.direction), start]).tolist())


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
