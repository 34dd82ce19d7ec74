"""The whole fixture as 3MF, and exact solids of its parts as STEP, which come from OpenCascade (OCP)."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import FileError, MissingExtraError
from workbench.base.types import Matrix4
from workbench.extras.workshop.meshes import MM, Part, cut, cylinders, mesh_of, prism
from workbench.extras.workshop.parts import Bore, Fixture, Turned


def step_of(part: Part, name: str) -> bytes:
    """A part as a STEP file [mm] in its own frame."""
    _require_step()
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec

    solid: Any = None
    if isinstance(part, Turned):
        for z, diameter, length in cylinders(part):
            axis = gp_Ax2(gp_Pnt(0.0, 0.0, z), gp_Dir(0.0, 0.0, 1.0))
            step = BRepPrimAPI_MakeCylinder(axis, 0.5 * diameter, length).Shape()
            solid = step if solid is None else BRepAlgoAPI_Fuse(solid, step).Shape()
    else:
        outline, width = prism(part)
        polygon = BRepBuilderAPI_MakePolygon()
        for x, z in outline:
            polygon.Add(gp_Pnt(float(x), -0.5 * width, float(z)))
        polygon.Close()
        face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
        solid = BRepPrimAPI_MakePrism(face, gp_Vec(0.0, width, 0.0)).Shape()
    for bore in part.bores:
        solid = BRepAlgoAPI_Cut(solid, _step_cutter(bore)).Shape()
    return _step_file(solid, name)


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


def _step_cutter(bore: Bore) -> Any:
    """What a bore takes away."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    start, mouth, end, length = cut(bore)
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
