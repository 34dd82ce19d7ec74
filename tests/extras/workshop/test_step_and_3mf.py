"""STEP and 3MF: to size, with exactly the material of their parts, each in its place."""

import io
import sys
from typing import NamedTuple

import numpy as np
import pytest
import trimesh

from tests.extras.workshop.test_solids import by_hand, parts
from workbench.base.errors import MissingExtraError
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.meshes import mesh_of
from workbench.extras.workshop.parts import Block
from workbench.extras.workshop.solids import step_of, three_mf


def test_three_mf_holds_every_part_in_its_place(made_plate, fixture):
    scene = trimesh.load(io.BytesIO(three_mf(fixture)), file_type="3mf")
    assert scene.units == "millimeter"
    assert set(scene.geometry) == {"plate", *(f"block {i + 1}" for i in range(len(made_plate)))}
    for name, mesh in scene.geometry.items():
        assert mesh.is_watertight, name
        part = fixture.slab if name == "plate" else fixture.blocks[int(name.split()[1]) - 1]
        assert np.isclose(mesh.volume / 1e9, by_hand(part), rtol=1e-7)
    for block in fixture.blocks:
        centre = 1e3 * block.pose[:3, 3]
        bounds = scene.geometry[f"block {block.number}"].bounds
        assert np.allclose(bounds[:, :2].mean(axis=0), centre[:2], atol=1e-3)
        assert np.isclose(bounds[0, 2], 0.0, atol=1e-6)


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
    for part in parts(fixture):
        found = read_step(step_of(part, "part"), tmp_path)
        assert np.isclose(found.volume, by_hand(part), rtol=1e-9)
        assert np.allclose(found.box, mesh_of(part).bounds, atol=1e-4)
        for bore in part.bores:
            if not bore.conical:
                axes = [(at, along) for at, along, r in found.cylinders if np.isclose(r, 500 * bore.diameter)]
                off = [np.linalg.norm(np.cross(1e3 * bore.mouth - at, along)) for at, along in axes]
                turned = [np.linalg.norm(np.cross(bore.direction, along)) for _, along in axes]
                assert min(np.hypot(off, turned)) < 1e-6
        if isinstance(part, Block):
            up = part.face[:3, 2]
            assert np.abs(found.normals - up).max(axis=1).min() < 1e-9
            assert np.abs(found.normals - [0.0, 0.0, -1.0]).max(axis=1).min() < 1e-9


def test_step_of_what_is_turned(plate, tmp_path):
    for part in fixture_of(plate).others:
        assert np.isclose(read_step(step_of(part, "part"), tmp_path).volume, by_hand(part), rtol=1e-9)


def test_a_missing_library_names_its_extra(mixed, monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP.STEPControl", None)
    with pytest.raises(MissingExtraError) as error:
        step_of(fixture_of(mixed).slab, "plate")
    assert error.value.extra == "step"
