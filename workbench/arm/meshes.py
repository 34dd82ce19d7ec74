"""Visual meshes of a URDF's links, as triangles in the frames of the links.

Meshes are searched at the path in the file, in its folder and the parent folder, and for `package://name/…`,
with or without the name, in every folder above the file; shorter ends of that path, which other arms have as
well, in these two alone. If they are missing, elsewhere or too large, the arm is drawn from its geometry.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from workbench.arm.robot import Robot, UrdfSource
from workbench.base.errors import FileError

GREY = (200, 204, 210)
MAX_FACES = 400_000
"""Maximum number of triangles; larger arms are drawn from their geometry."""
MAX_MESH_BYTES = 50 * MAX_FACES
"""Maximum size of a mesh file [bytes]: that of an STL of so many triangles."""
SCHEME = "package://"


@dataclass(frozen=True, eq=False)
class LinkMesh:
    """One piece of a link.

    Args:
        entry: The link's place in the chain: 0 for its root, i + 1 for the link after joint entry i.
        vertices: Corners in the link's frame [m].
        faces: Indices of the corners.
        colour: Red, green, blue of 255.
    """

    entry: int
    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    colour: tuple[int, int, int]


def link_meshes(robot: Robot) -> tuple[LinkMesh, ...]:
    """All meshes of the robot's file; none if it is no URDF, or if they are missing."""
    if robot.urdf is None or not robot.urdf.path.is_file():
        return ()
    import yourdfpy

    path = robot.urdf.path
    logging.getLogger("yourdfpy").setLevel(logging.CRITICAL)
    try:
        model = yourdfpy.URDF.load(
            str(path),
            build_scene_graph=True,
            load_meshes=True,
            filename_handler=lambda fname: _found(fname, path),
        )
        pieces = tuple(_pieces(model, robot.urdf))
    except Exception:  # a broken mesh file: the arm can be drawn without it
        return ()
    return pieces if 0 < sum(len(p.faces) for p in pieces) <= MAX_FACES else ()


def find_mesh(name: str, urdf: Path) -> str:
    """Path of a mesh that a URDF names."""
    relative = name.removeprefix(SCHEME).removeprefix("file://")
    folders = urdf.resolve().parents
    if name.startswith(SCHEME):
        parts = Path(relative).parts  # of a package without its repository only the end may be there
        ends = ((k, parts[k:]) for k in range(max(len(parts) - 1, 1)))
        places = [(f, f.joinpath(*end)) for k, end in ends for f in folders[: -1 if k < 2 else 2]]
    else:
        places = [(folders[min(1, len(folders) - 1)], folders[0] / relative)]
    for folder, candidate in places:
        path = candidate.resolve()
        if path.is_relative_to(folder) and path.is_file():
            if path.stat().st_size > MAX_MESH_BYTES:
                most = MAX_MESH_BYTES // 10**6
                raise FileError(f"is larger than {most} MB; give a coarser mesh", path=str(path))
            return str(path)
    raise FileError("no such mesh in the robot's folders; add it", path=name)


def _found(name: str, urdf: Path) -> str:
    """Path of a mesh; empty if it can't be used, so that the others are drawn."""
    try:
        return find_mesh(name, urdf)
    except FileError:
        return ""


def _pieces(model: Any, source: UrdfSource) -> Iterator[LinkMesh]:
    """Visual geometry of a `yourdfpy.URDF`."""
    import trimesh

    links = [source.root, *(model.joint_map[name].child for name in source.joints)]
    graph = model.scene.graph
    for node in graph.nodes_geometry:
        link = graph.transforms.parents[node]
        pose, name = graph.get(node, frame_from=link)
        mesh = model.scene.geometry[name]
        if link not in links or not isinstance(mesh, trimesh.Trimesh):
            continue
        vertices = trimesh.transform_points(mesh.vertices, pose)
        yield LinkMesh(links.index(link), np.array(vertices), np.array(mesh.faces, np.int64), _colour(mesh))


def _colour(mesh: Any) -> tuple[int, int, int]:
    try:
        visual = mesh.visual
        main = getattr(visual, "material", visual).main_color
        red, green, blue = (int(v) for v in main[:3])
    except Exception:  # textures that can't be read
        return GREY
    return red, green, blue
