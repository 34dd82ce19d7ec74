"""Robots whose files name others elsewhere, or grow without end: nothing is opened or fetched."""

import json
import subprocess
import sys

import pytest
import trimesh

from workbench.arm.meshes import link_meshes
from workbench.arm.urdf import read_urdf
from workbench.base.errors import FileError

NESTED = (
    '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {chr(98 + k)} "{("&" + chr(97 + k) + ";") * 10}">' for k in range(9))
    + "]>"
)
REPEATED = f'<!DOCTYPE r [<!ENTITY j "{"a" * 100_000}">]>'
EXTERNAL = '<!DOCTYPE r [<!ENTITY j SYSTEM "file:///etc/passwd">]>'
ELSEWHERE = (
    "file://{0}/secret.stl",
    "{0}/secret.stl",
    "../../secret.stl",
    "package://../../secret.stl",
    "package://robot/../../secret.stl",
    "http://127.0.0.1:9/a.stl",
    "ftp://127.0.0.1/a.obj",
    "/dev/zero",
    "/proc/self/environ",
)


def urdf(mesh: str = "near.stl", *, head: str = "", more: str = "", texture: str = "") -> str:
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    joint = f'<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{limit}</joint>'
    seen = f'<visual><geometry><mesh filename="{mesh}"/></geometry>{texture}</visual>'
    return f'{head}<robot name="r"><link name="a">{seen}{more}</link><link name="b"/>{joint}</robot>'


def dae(*, head: str = "", title: str = "", images: str = "") -> str:
    """One triangle."""
    axes = "".join(f'<param name="{axis}" type="float"/>' for axis in "XYZ")
    reach = (
        f'<technique_common><accessor source="#q" count="3" stride="3">{axes}</accessor></technique_common>'
    )
    source = f'<source id="p"><float_array id="q" count="9">0 0 0 1 0 0 0 1 0</float_array>{reach}</source>'
    corners = '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
    faces = '<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>'
    mesh = f'<geometry id="g"><mesh>{source}{corners}{faces}</mesh></geometry>'
    body = f"<library_geometries>{mesh}</library_geometries>"
    nodes = '<node id="n"><instance_geometry url="#g"/></node>'
    scene = f'<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
    start = f'{head}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
    end = '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    return f"{start}<asset><title>{title}</title></asset>{images}{body}{scene}{end}"


@pytest.fixture
def robot(tmp_path):
    """Writes a robot into a folder beside which secrets lie; its file."""
    box = trimesh.creation.box().export(file_type="stl")
    place = tmp_path / "robot" / "urdf"
    place.mkdir(parents=True)
    (place / "near.stl").write_bytes(box)
    for name in ("secret.stl", "secret.png", "secret.mtl"):
        (tmp_path / name).write_bytes(box)

    def write(text: str):
        (place / "arm.urdf").write_text(text)
        return place / "arm.urdf"

    return write


@pytest.mark.parametrize("head", [NESTED, REPEATED, EXTERNAL])
def test_entities_of_a_urdf_are_not_expanded(robot, head):
    with pytest.raises(FileError, match="is not a URDF"):
        read_urdf(robot(urdf(head=head, more=f"<x>{'&j;' * (20_000 if head is REPEATED else 1)}</x>")))


@pytest.mark.parametrize("head", [NESTED, REPEATED, EXTERNAL])
def test_entities_of_a_mesh_are_not_expanded(robot, head):
    path = robot(urdf("a.dae"))
    mesh = path.with_name("a.dae")
    mesh.write_text(dae())
    assert [len(piece.faces) for piece in link_meshes(read_urdf(path))] == [1]
    mesh.write_text(dae(head=head, title="&j;" * (20_000 if head is REPEATED else 1)))
    assert link_meshes(read_urdf(path)) == ()


OPENED = """
import json, os, sys
from pathlib import Path
from workbench.arm.meshes import link_meshes
from workbench.arm.urdf import read_urdf
import trimesh, yourdfpy, collada
paths, found = sys.argv[1:], []
robots = [read_urdf(Path(path)) for path in paths]
def hook(event, args):
    if event == "open" and isinstance(args[0], str) and "secret" in os.path.realpath(args[0]):
        found.append(args[0])
    if event in ("socket.connect", "socket.getaddrinfo", "urllib.Request"):
        found.append(event)
    if event == "open" and str(args[0]).startswith(("/dev/zero", "/proc/self/environ")):
        found.append(args[0])
sys.addaudithook(hook)
faces = [sum(len(piece.faces) for piece in link_meshes(robot)) for robot in robots]
open(paths[0]).close()
print(json.dumps([faces, found]))
"""


def test_nothing_elsewhere_is_opened_or_fetched(robot, tmp_path):
    texture = '<material name="m"><texture filename="{}"/></material>'
    texts = [urdf(name.format(tmp_path)) for name in ELSEWHERE]
    texts += [urdf(texture=texture.format(f"{tmp_path}/secret.png"))]
    texts += [urdf("a.obj"), urdf("a.dae")]
    paths = []
    for k, text in enumerate(texts):
        path = robot(text)
        paths.append(str(path.rename(path.with_name(f"{k}.urdf"))))
    lines = ("mtllib ../../secret.mtl", "mtllib http://127.0.0.1:9/a.mtl", "mtllib m.mtl", "usemtl a")
    corners = ("v 0 0 0", "v 1 0 0", "v 0 1 0", "vt 0 0", "f 1/1 2/1 3/1")
    folder = tmp_path / "robot" / "urdf"
    (folder / "a.obj").write_text("\n".join([*lines, *corners]) + "\n")
    (folder / "m.mtl").write_text("newmtl a\nmap_Kd ../../secret.png\n")
    names = (f"file://{tmp_path}/secret.png", "../../secret.png", "http://127.0.0.1:9/a.png")
    images = "".join(f'<image id="i{k}"><init_from>{n}</init_from></image>' for k, n in enumerate(names))
    (folder / "a.dae").write_text(dae(images=f"<library_images>{images}</library_images>"))
    done = subprocess.run([sys.executable, "-c", OPENED, *paths], capture_output=True, text=True)
    faces, found = json.loads(done.stdout)
    assert faces == [0] * len(ELSEWHERE) + [12, 1, 1]
    assert found == []
