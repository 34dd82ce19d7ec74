"""The page as a sink: a viser node for every drawable, of which only what has changed is sent.

Poses are set only where they differ. There are no shadows, so that computers without a graphics card keep up.
"""

import itertools
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from workbench.base import se3
from workbench.base.types import Matrix4
from workbench.views.appearance.bodies import Body
from workbench.views.appearance.colours import linear
from workbench.views.appearance.shapes import cuboid_edges
from workbench.views.drawables.drawable import Arm, Arrows, Cubes, Cuboid, Label, Mesh, Points
from workbench.views.drawables.sink import AbstractSink, Item, differences, is_same
from workbench.views.page.scene.cube_mesh import Node, add_cubes
from workbench.views.page.scene.picking import Ray, picked
from workbench.views.page.viser_internals import set_pose

REDRAWN = 0.25
"""Minimum time between two drawings of what can wait [s]."""


class PageSink(AbstractSink):
    """Draws what is shown; what is hidden is made, or changed, when it is shown again."""

    def __init__(self, server: viser.ViserServer):
        super().__init__()
        self._server = server
        self._nodes: dict[str, Node] = {}
        self._drawn_at: dict[str, float] = {}
        self.is_behind = False
        self._count = itertools.count(1)

    def puts_off(self, item: Item) -> bool:
        since = time.monotonic() - self._drawn_at.get(item.path, -math.inf)
        waits = item.shown and item.can_wait and since < REDRAWN
        self.is_behind |= waits
        return waits or not item.shown

    def show(self, path: str, drawn: Any, *, is_shown: bool) -> None:
        self._nodes[path].root.visible = is_shown

    def change(self, item: Item, old: Any, new: Any) -> None:
        self._drawn_at[item.path] = time.monotonic()
        if old is not None:
            if self._nodes[item.path].change(old, new):
                if item.path in self._hidden:  # viser would send it in any case
                    self._nodes[item.path].root.visible = True
                return
            self.remove(item.path)
        name = f"/{item.path}"
        if isinstance(new, Points | Cubes):  # or else a page goes on with the old numbers of instances
            name += f"/{next(self._count)}"
        self._nodes[item.path] = ADD[type(new)](self._server, name, new)

    def picked(self, ray: Ray, *, points_first: bool) -> tuple[str, int] | None:
        """Path and number of what a click means; None if nothing is there."""
        shown = ((path, self._drawn[path][1]) for path in self._nodes.keys() - self._hidden)
        return picked(shown, ray, points_first=points_first)

    def remove(self, path: str) -> None:
        if (node := self._nodes.pop(path, None)) is not None:
            node.root.remove()


def _add_mesh(server: viser.ViserServer, name: str, mesh: Mesh) -> Node:
    node = server.scene.add_mesh_simple(
        name,
        mesh.solid.vertices,
        mesh.solid.faces,
        color=mesh.colour,
        flat_shading=mesh.flat,
        opacity=None if mesh.opacity == 1.0 else mesh.opacity,
        cast_shadow=False,
        receive_shadow=False,
    )
    if mesh.pose is not None:
        _put(node, mesh.pose)

    def change(old: Mesh, new: Mesh) -> bool:
        changed = differences(old, new)
        if changed - {"solid", "colour", "pose"} or not is_same(old.solid.faces, new.solid.faces):
            return False
        if "solid" in changed and not is_same(old.solid.vertices, new.solid.vertices):
            node.vertices = new.solid.vertices
        if "colour" in changed:
            node.color = new.colour
        if "pose" in changed and new.pose is not None:
            _put(node, new.pose)
        return True

    return Node(node, change)


def _put(node: viser.SceneNodeHandle, pose: Matrix4) -> None:
    set_pose(node, pose[:3, 3], se3.matrix_to_quaternion(pose[:3, :3]))


def _add_arm(server: viser.ViserServer, name: str, arm: Arm) -> Node:
    """A frame for every body."""
    root = server.scene.add_frame(name, show_axes=False)
    bodies = [server.scene.add_frame(f"{name}/body{i}", show_axes=False) for i in range(len(arm.bodies))]
    for node, body in zip(bodies, arm.bodies, strict=True):
        for j, part in enumerate(_parts(arm, body)):
            _add_mesh(server, f"{node.name}/part{j}", part)

    def move(old: np.ndarray, new: np.ndarray) -> None:
        """Only bodies that are elsewhere."""
        moved = np.flatnonzero((old[:, :3, 3] != new[:, :3, 3]).any(axis=1))
        turned = np.flatnonzero((old[:, :3, :3] != new[:, :3, :3]).any(axis=(1, 2)))
        for i in moved:
            set_pose(bodies[i], new[i, :3, 3])
        for i, wxyz in zip(turned, se3.matrix_to_quaternion(new[turned, :3, :3]), strict=True):
            set_pose(bodies[i], wxyz=wxyz)

    def change(old: Arm, new: Arm) -> bool:
        changed = differences(old, new) - {"frames"}
        if changed - {"bodies"} or (changed and not _look_alike(old.bodies, new.bodies)):
            return False
        move(old.frames, new.frames)
        return True

    move(np.full_like(arm.frames, np.nan), arm.frames)
    return Node(root, change)


def _look_alike(old: tuple[Body, ...], new: tuple[Body, ...]) -> bool:
    """Whether bodies of two arms are the same to the eye, as those of an arm and of its file's copy."""
    if [len(body.parts) for body in old] != [len(body.parts) for body in new]:
        return False
    parts = zip((p for body in old for p in body.parts), (p for body in new for p in body.parts), strict=True)
    return all(
        a.colour == b.colour
        and is_same(a.solid.vertices, b.solid.vertices)
        and is_same(a.solid.faces, b.solid.faces)
        for a, b in parts
    )


def _parts(arm: Arm, body: Body) -> list[Mesh]:
    """A translucent body is one solid, so that nothing shines through inside."""
    if arm.ghost is None:
        return [Mesh(solid=part.solid, colour=part.colour) for part in body.parts]
    return [] if body.solid is None else [Mesh(solid=body.solid, colour=arm.ghost, opacity=arm.opacity)]


def _add_points(server: viser.ViserServer, name: str, points: Points) -> Node:
    """As one cloud, whose every point costs next to nothing."""
    node = server.scene.add_point_cloud(
        name,
        points.places,
        points.colours,
        point_size=2.0 * points.radius,
        point_shape="square" if points.are_squares else "circle",
        precision="float32",
    )

    def change(old: Points, new: Points) -> bool:
        changed = differences(old, new)
        if changed == {"colours"}:
            node.colors = new.colours
        return changed <= {"colours"}

    return Node(node, change)


def _add_arrows(server: viser.ViserServer, name: str, arrows: Arrows) -> Node:
    ends = np.stack([arrows.starts, arrows.ends], 1)
    colour = linear(np.array([arrows.colour], np.uint8))[0]
    shaft, head, length = (arrows.thick * size for size in (0.0018, 0.0045, 0.012))
    add = server.scene.add_arrows
    return Node(add(name, ends, colors=colour, shaft_radius=shaft, head_radius=head, head_length=length))


def _add_cuboid(server: viser.ViserServer, name: str, cuboid: Cuboid) -> Node:
    """Its edges, as wide from near and far."""
    edges, is_one = cuboid_edges(cuboid.low, cuboid.high, cuboid.cubes), max(cuboid.cubes) == 1
    add, pixels = server.scene.add_line_segments, 1.6 if is_one else 0.5
    return Node(add(name, edges, colors=np.array(cuboid.colour), thickness=pixels, thickness_units="screen"))


def _add_label(server: viser.ViserServer, name: str, label: Label) -> Node:
    node = server.scene.add_label(
        name, label.text, position=label.place, anchor="bottom-center", font_screen_scale=0.85
    )

    def change(old: Label, new: Label) -> bool:
        node.position, node.text = new.place, new.text
        return True

    return Node(node, change)


ADD: dict[type, Callable[[viser.ViserServer, str, Any], Node]] = {
    Mesh: _add_mesh,
    Arm: _add_arm,
    Points: _add_points,
    Arrows: _add_arrows,
    Cuboid: _add_cuboid,
    Label: _add_label,
    Cubes: add_cubes,
}
