"""The parts as solids in millimetres: meshes for STL by manifold3d, exact ones for STEP by OpenCascade.

In a mesh a circle becomes a polygon of its area, so that the mesh has the volume of its part exactly; with 96
corners its radius is off by 0.04 %.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import FileError, MissingExtraError
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


def step_of(part: Part, name: str) -> bytes:
    """A STEP file of a part in its own frame."""
    try:
        from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
        from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
        from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec
    except ImportError:
        raise MissingExtraError("writing STEP files", extra="step") from None

    def cylinder(start: Vector3, direction: Vector3, radius: float, end: float, length: float) -> Any:
        axis = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*np.asarray(direction).tolist()))
        if end == radius:
            return BRepPrimAPI_MakeCylinder(axis, radius, length).Shape()
        return BRepPrimAPI_MakeCone(axis, radius, end, length).Shape()

    outline, width = _prism(part)
    polygon = BRepBuilderAPI_MakePolygon()
    for x, z in outline:
        polygon.Add(gp_Pnt(float(x), -0.5 * width, float(z)))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    solid: Any = BRepPrimAPI_MakePrism(face, gp_Vec(0.0, width, 0.0)).Shape()
    for bore in part.bores:
        start, *sizes = _cut(bore)
        solid = BRepAlgoAPI_Cut(solid, cylinder(start, bore.direction, *sizes)).Shape()
    return _step_file(solid, name)


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
