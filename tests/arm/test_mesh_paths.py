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


def test_a_mesh_of_too_many_triangles_is_not_even_read(urdf):
    (urdf.parent / "near.stl").write_bytes(bytes(84 + 50 * 400_001))
    with refuses(FileError, "larger than 20 MB"):
        meshes.find_mesh("near.stl", urdf)
