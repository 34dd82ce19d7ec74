"""STL: watertight, to size, with exactly the material of their parts, and bores in place."""

import io
import sys

import numpy as np
import pytest
import trimesh

from workbench.base.errors import MissingExtraError
from workbench.extras.workshop.fixture import fixture_of
from workbench.extras.workshop.parts import Block
from workbench.extras.workshop.solids import stl_of
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


def test_a_missing_library_names_its_extra(mixed, monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(MissingExtraError) as error:
        stl_of(fixture_of(mixed).slab)
    assert error.value.extra == "cad"
