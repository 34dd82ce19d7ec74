"""STL and STEP: watertight, to size, with exactly the material of their parts, and bores in place."""

import io
import sys
from typing import NamedTuple

import numpy as np
import trimesh
from refusals import refuses

from workbench.base.errors import MissingExtraError
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.parts import Block
from workbench.extras.workshop.solids import step_of, stl_of
from workbench.plate.optimiser.target_blocks import SIDE


def by_hand(part) -> float:
    """Volume of a part in m³, from its drawing."""
    whole = SIDE**2 * part.height if isinstance(part, Block) else float(np.prod(part.size))
    cones = sum(np.pi / 12.0 * b.diameter**2 * b.depth for b in part.bores if b.conical)
    return whole - cones - sum(np.pi / 4.0 * b.diameter**2 * b.depth for b in part.bores if not b.conical)


def box_of(part) -> np.ndarray:
    """Its lowest and highest corner [mm], from its drawing."""
    if isinstance(part, Block):
        half, high = 0.5 * SIDE, part.height + 0.5 * SIDE * np.tan(part.tilt)
        return 1e3 * np.array([[-half, -half, 0.0], [half, half, high]])
    x, y, z = 0.5 * part.size
    return 1e3 * np.array([[-x, -y, -2.0 * z], [x, y, 0.0]])


def mesh_of(part):
    return trimesh.load(io.BytesIO(stl_of(part)), file_type="stl")


def test_stl_is_watertight_and_to_size(fixture):
    for part in fixture.made.values():
        mesh = mesh_of(part)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert np.isclose(mesh.volume / 1e9, by_hand(part), rtol=1e-6)
        assert np.allclose(mesh.bounds, box_of(part), atol=1e-4)
        assert mesh.euler_number == 2 - 2 * sum(b.through for b in part.bores)


def test_holes_are_where_the_bores_are(fixture):
    """A point in the middle of each bore is outside the material, one beside its wall is inside."""
    for block in fixture.blocks[:3]:
        solid = mesh_of(block)
        for bore in block.bores:
            inner = 1e3 * (bore.mouth + 0.3 * bore.depth * bore.direction)
            side = np.cross(bore.direction, [0.0, 1.0, 0.0])
            beside = inner + 1e3 * (0.5 * bore.diameter + 4e-4) * side / np.linalg.norm(side)
            assert solid.contains([inner, beside]).tolist() == [False, True]


class Read(NamedTuple):
    """A STEP file as OpenCascade reads it: volume [m³], box [mm], cylinders (axis, radius), plane normals."""

    volume: float
    box: np.ndarray
    cylinders: list[tuple[np.ndarray, np.ndarray, float]]
    normals: np.ndarray


def read_step(content, folder):
    from OCP.Bnd import Bnd_Box
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.GeomAbs import GeomAbs_Cylinder, GeomAbs_Plane
    from OCP.GProp import GProp_GProps
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_FACE, TopAbs_REVERSED
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    path = folder / "part.step"
    path.write_bytes(content)
    reader = STEPControl_Reader()
    assert reader.ReadFile(str(path)) == IFSelect_RetDone
    assert reader.TransferRoots()
    shape, properties, box = reader.OneShape(), GProp_GProps(), Bnd_Box()
    BRepGProp.VolumeProperties_s(shape, properties)
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    cylinders, normals, faces = [], [], TopExp_Explorer(shape, TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face(faces.Current())
        surface = BRepAdaptor_Surface(face)
        if surface.GetType() == GeomAbs_Cylinder:
            axis, at = (surface.Cylinder().Axis().Direction(), surface.Cylinder().Axis().Location())
            ends = [np.array([v.X(), v.Y(), v.Z()]) for v in (at, axis)]
            cylinders.append((*ends, surface.Cylinder().Radius()))
        elif surface.GetType() == GeomAbs_Plane:
            out = surface.Plane().Axis().Direction()
            sign = -1.0 if (face.Orientation() == TopAbs_REVERSED) == surface.Plane().Direct() else 1.0
            normals.append(sign * np.array([out.X(), out.Y(), out.Z()]))
        faces.Next()
    corners = np.array([[v.X(), v.Y(), v.Z()] for v in (box.CornerMin(), box.CornerMax())])
    return Read(float(properties.Mass()) / 1e9, corners, cylinders, np.array(normals))


def test_step_comes_back_with_its_sizes_bores_and_normals(fixture, tmp_path):
    """Box, axis and radius of every bore, and every plane's outward normal, as in the part."""
    for part in fixture.made.values():
        found = read_step(step_of(part, "part"), tmp_path)
        assert np.isclose(found.volume, by_hand(part), rtol=1e-9)
        assert np.allclose(found.box, box_of(part), atol=1e-4)
        for bore in part.bores:
            if not bore.conical:
                axes = [(at, along) for at, along, r in found.cylinders if np.isclose(r, 500 * bore.diameter)]
                off = [np.linalg.norm(np.cross(1e3 * bore.mouth - at, along)) for at, along in axes]
                turned = [np.linalg.norm(np.cross(bore.direction, along)) for _, along in axes]
                assert min(np.hypot(off, turned)) < 1e-6
        if isinstance(part, Block):
            up = np.array([np.sin(part.tilt), 0.0, np.cos(part.tilt)])
            assert np.abs(found.normals - up).max(axis=1).min() < 1e-9
            assert np.abs(found.normals - [0.0, 0.0, -1.0]).max(axis=1).min() < 1e-9


def test_a_missing_library_names_its_extra(mixed, monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    monkeypatch.setitem(sys.modules, "OCP.BRepAlgoAPI", None)
    slab = fixture_of(mixed).slab
    for write, extra in ((stl_of, "cad"), (lambda part: step_of(part, "plate"), "step")):
        with refuses(MissingExtraError, extra=extra):
            write(slab)
