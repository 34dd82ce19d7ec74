"""Meshes of a URDF come from the robot's own folders, and are of a size that can be drawn."""

import pytest
from refusals import refuses

from workbench.arm import meshes
from workbench.base.errors import FileError

FILES = ("robot/urdf/arm.urdf", "robot/meshes/link.stl", "robot/urdf/near.stl", "elsewhere.stl")


@pytest.fixture
def urdf(tmp_path):
    for name in (*FILES, "meshes/base.stl"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"solid")
    return tmp_path / "robot" / "urdf" / "arm.urdf"


@pytest.mark.parametrize(
    "name",
    ["near.stl", "../meshes/link.stl", *(f"package://{up}robot/meshes/link.stl" for up in ("", "all/"))],
)
def test_meshes_of_the_robot_are_found(urdf, name):
    assert meshes.find_mesh(name, urdf).endswith(".stl")
    with refuses(FileError, "no such mesh"):  # another arm's
        meshes.find_mesh("package://robot_description/visual/meshes/base.stl", urdf)


@pytest.mark.parametrize(
    ("name", "content"),
    [("near.obj", b"v 0 0 0\n" + b"f 1 1 1\n" * 400_001), ("near.stl", bytes(84 + 50 * 400_001))],
)
def test_a_mesh_of_too_many_triangles_is_not_even_read(urdf, name, content):
    (urdf.parent / name).write_bytes(content)
    with refuses(FileError, 400000):
        meshes.find_mesh(name, urdf)
