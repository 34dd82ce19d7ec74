"""Solids: watertight, to size, with exactly the material of their parts."""

import io
import sys

import numpy as np
import pytest
import trimesh

from workbench.base import se3
from workbench.base.errors import MissingExtraError
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.meshes import mesh_of, stl
from workbench.extras.workshop.parts import Block, Purpose, Turned


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


def test_probe_bottom_plate_and_stand_offs_are_solids_too(plate, tmp_path):
    """The probe's pins are where a seat's bores are; stand-offs reach from the robot's foot to the plate."""
    fixture = fixture_of(plate)
    probe, bottom, post = fixture.others
    for part in (probe, post):
        mesh = trimesh.load(io.BytesIO(stl(mesh_of(part))), file_type="stl")
        assert mesh.is_watertight
        assert np.isclose(mesh.volume / 1e9, by_hand(part), rtol=1e-6)
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


def test_a_missing_library_names_its_extra(mixed, monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(MissingExtraError) as error:
        mesh_of(fixture_of(mixed).slab)
    assert error.value.extra == "cad"
