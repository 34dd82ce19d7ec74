"""Solids: watertight, to size, with exactly the material of their parts; three ways to the same volume."""

import io
from typing import NamedTuple

import numpy as np
import pytest
import trimesh

from workbench.base import se3
from workbench.plate.parts.fixture import fixture_of
from workbench.plate.parts.parts import Block, Purpose, Turned
from workbench.plate.parts.solids import mesh_of, step_of, stl, three_mf


def by_hand(part) -> float:
    """Volume of a part in m³, from its drawing."""
    if isinstance(part, Turned):
        whole = sum(np.pi / 4.0 * diameter**2 * length for diameter, length in part.steps)
    else:
        whole = part.side**2 * part.height if isinstance(part, Block) else float(np.prod(part.size))
    cones = sum(np.pi / 12.0 * b.diameter**2 * b.depth for b in part.bores if b.conical)
    return whole - cones - sum(np.pi / 4.0 * b.diameter**2 * b.depth for b in part.bores if not b.conical)


def parts(fixture):
    return [fixture.slab, *fixture.blocks[:3]]


def test_stl_is_watertight_and_to_size(fixture):
    for part in parts(fixture):
        back = trimesh.load(io.BytesIO(stl(mesh_of(part))), file_type="stl")
        assert back.is_watertight
        assert back.is_winding_consistent
        assert np.isclose(back.volume / 1e9, by_hand(part), rtol=1e-7)
        if isinstance(part, Block):
            high = part.height + 0.5 * part.side * np.tan(part.tilt)
            half = 0.5 * part.side
            assert np.allclose(
                back.bounds, 1e3 * np.array([[-half, -half, 0.0], [half, half, high]]), atol=1e-4
            )
        else:
            assert np.allclose(back.extents, 1e3 * part.size, atol=1e-4)
            assert np.isclose(back.bounds[1, 2], 0.0, atol=1e-6)
        assert back.euler_number == 2 - 2 * sum(b.through for b in part.bores)


def test_holes_are_where_the_bores_are(fixture):
    """A point in the middle of each bore is outside the material, one beside its wall is inside."""
    for part in parts(fixture)[1:]:
        solid = mesh_of(part)
        for bore in part.bores:
            inner = 1e3 * (bore.mouth + 0.3 * bore.depth * bore.direction)
            side = np.cross(bore.direction, [0.0, 1.0, 0.0])
            beside = inner + 1e3 * (0.5 * bore.diameter + 4e-4) * side / np.linalg.norm(side)
            assert solid.contains([inner, beside]).tolist() == [False, True]


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


def step_volume(content, folder):
    return read_step(content, folder).volume


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


def test_probe_bottom_plate_and_stand_offs_are_solids_too(plate, tmp_path):
    """The probe's pins are where a seat's bores are; stand-offs reach from the robot's foot to the plate."""
    fixture = fixture_of(plate)
    probe, bottom, post = fixture.others
    for part in (probe, post):
        mesh = trimesh.load(io.BytesIO(stl(mesh_of(part))), file_type="stl")
        assert mesh.is_watertight
        assert np.isclose(mesh.volume / 1e9, by_hand(part), rtol=1e-6)
        assert np.isclose(step_volume(step_of(part, "part"), tmp_path), by_hand(part), rtol=1e-9)
    assert np.isclose(step_volume(step_of(bottom, "part"), tmp_path), by_hand(bottom), rtol=1e-9)
    pins = [b.mouth[:2] for b in probe.bores if b.purpose is Purpose.PIN]
    seat, index = (b for b in fixture.blocks[0].bores if b.direction[2] < 0.0)
    assert np.isclose(np.linalg.norm(pins[1] - pins[0]), np.linalg.norm(index.mouth - seat.mouth))
    assert np.isclose(post.length, fixture.pose[2, 3] - fixture.slab.size[2])
    mounts = [se3.apply(fixture.pose, b.mouth)[:2] for b in fixture.slab.bores if b.label.startswith("M")]
    foot = [b.mouth[:2] for b in bottom.bores if b.purpose is Purpose.ROBOT]
    below = [b.mouth[:2] - np.mean(foot, axis=0) for b in bottom.bores if b.purpose is Purpose.STANDOFF]
    assert np.allclose(below, mounts)


def test_a_leaning_plate_has_no_stand_offs_and_says_so(mixed):
    fixture = fixture_of(mixed)
    assert fixture.standoff is None
    assert "leans by" in " ".join(fixture.notes)


@pytest.mark.parametrize("library", ["manifold3d", "OCP.STEPControl", "ezdxf"])
def test_a_missing_library_names_its_extra(library, mixed, monkeypatch):
    import sys

    from workbench.base.errors import MissingExtraError
    from workbench.plate.parts.drawing import Page, dxf_of

    monkeypatch.setitem(sys.modules, library, None)
    fixture = fixture_of(mixed)
    work = {
        "manifold3d": lambda: mesh_of(fixture.slab),
        "OCP.STEPControl": lambda: step_of(fixture.slab, "plate"),
        "ezdxf": lambda: dxf_of(Page(name="empty")),
    }[library]
    with pytest.raises(MissingExtraError) as error:
        work()
    assert error.value.extra == ("step" if library.startswith("OCP") else "cad")
