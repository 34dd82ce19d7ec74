"""The parts as exact solids in a STEP file, through the optional library OpenCascade (OCP).

Each part is built from the same description as its mesh: a prism from its side view, less its bores.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from workbench.base.errors import FileError, MissingExtraError
from workbench.base.types import Vector3
from workbench.plate.parts.parts import Block, Bore, Slab

MM = 1e3
BEYOND = 1.0
"""How far cutters stand out of the material [mm]."""


def slab_step(slab: Slab, name: str) -> bytes:
    """The plate as a STEP file [mm], its top at z = 0."""
    length, width, thickness = (MM * slab.size).tolist()
    outline = [(-length / 2, -thickness), (length / 2, -thickness), (length / 2, 0.0), (-length / 2, 0.0)]
    return _file(_solid(outline, width, slab.bores), name)


def block_step(block: Block, name: str) -> bytes:
    """A block as a STEP file [mm] in its own frame."""
    half, (low, high) = 0.5 * MM * block.side, (MM * h for h in block.heights)
    outline = [(-half, 0.0), (half, 0.0), (half, low), (-half, high)]
    return _file(_solid(outline, 2.0 * half, block.bores), name)


def step_volume(content: bytes) -> float:
    """Volume of the solids in a STEP file [m³].

    Raises:
        FileError: it holds none.
    """
    _require()
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    with tempfile.TemporaryDirectory(prefix="workbench-") as folder:
        path = Path(folder) / "part.step"
        path.write_bytes(content)
        reader = STEPControl_Reader()
        if reader.ReadFile(str(path)) != IFSelect_RetDone or not reader.TransferRoots():
            raise FileError("holds no solid that can be read; export it again", path="STEP file")
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(reader.OneShape(), properties)
    return float(properties.Mass()) / MM**3


def _solid(outline: list[tuple[float, float]], width: float, bores: tuple[Bore, ...]) -> Any:
    """A prism along y over an outline in (x, z), less its bores [mm]."""
    _require()
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    polygon = BRepBuilderAPI_MakePolygon()
    for x, z in outline:
        polygon.Add(gp_Pnt(float(x), -0.5 * width, float(z)))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    solid = BRepPrimAPI_MakePrism(face, gp_Vec(0.0, width, 0.0)).Shape()
    for bore in bores:
        solid = BRepAlgoAPI_Cut(solid, _cutter(bore)).Shape()
    return solid


def _cutter(bore: Bore) -> Any:
    """What a bore takes away, standing a little out of its mouth, and out of its end if it goes through."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    start: Vector3 = MM * bore.mouth - BEYOND * bore.direction
    axis = gp_Ax2(gp_Pnt(*start.tolist()), gp_Dir(*np.asarray(bore.direction).tolist()))
    radius, depth = 0.5 * MM * bore.diameter, MM * bore.depth
    if bore.conical:
        return BRepPrimAPI_MakeCone(axis, radius * (1.0 + BEYOND / depth), 0.0, depth + BEYOND).Shape()
    return BRepPrimAPI_MakeCylinder(axis, radius, depth + BEYOND * (1 + bore.through)).Shape()


def _file(solid: Any, name: str) -> bytes:
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


def _require() -> None:
    """Refuse where the library is missing.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import OCP.STEPControl  # noqa: F401
    except ImportError:
        raise MissingExtraError("writing STEP files", extra="step") from None
