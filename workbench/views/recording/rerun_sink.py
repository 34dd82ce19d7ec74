"""A recording as a sink: an entity of rerun's for every drawable, of which only what has changed is logged.

What the page hides is cleared, and drawn again once it is shown.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import rerun as rr

from workbench.base import se3
from workbench.views.appearance.shapes import Solid, cuboid_edges
from workbench.views.drawables.drawable import FILL, Arm, Arrows, Cubes, Cuboid, Label, Mesh, Points
from workbench.views.drawables.sink import AbstractSink, Item, differences, is_same
from workbench.views.recording.canvas import Canvas

LABEL = (0, 0, 0)
THIN = 0.0015
"""Radius of lines and arrows [m]."""


class RecordingSink(AbstractSink):
    """Draws onto a canvas, below a prefix."""

    def __init__(self, canvas: Canvas, prefix: str = ""):
        super().__init__()
        self._canvas, self._prefix = canvas, prefix

    def puts_off(self, item: Item) -> bool:
        return item.can_wait or not item.shown

    def show(self, path: str, drawn: Any, *, is_shown: bool) -> None:
        if is_shown:
            self._log(path, None, drawn)
        else:
            self._canvas.clear(self._prefix + path)

    def change(self, item: Item, old: Any, new: Any) -> None:
        self._log(item.path, None if item.path in self._hidden else old, new)

    def _log(self, path: str, old: Any, new: Any) -> None:
        path = self._prefix + path
        if isinstance(new, rr.AsComponents):
            self._canvas.log(path, new)
        elif type(new) in LOG:
            LOG[type(new)](self._canvas, path, old, new)
        elif old is None or differences(old, new):
            self._canvas.log(path, WHOLE[type(new)](new))

    def remove(self, path: str) -> None:
        self._canvas.clear(self._prefix + path)


def mesh(solid: Solid, colour: tuple[int, ...], *, flat: bool = False) -> rr.Mesh3D:
    """A solid of one colour (or opacity too); `flat` where its triangles are not parts of a round body."""
    if flat:
        corners = solid.vertices[solid.faces].reshape(-1, 3)
        solid = Solid(corners, np.arange(len(corners)).reshape(-1, 3))
    return rr.Mesh3D(
        vertex_positions=solid.vertices,
        triangle_indices=solid.faces,
        vertex_normals=_normals(solid),
        albedo_factor=colour,
    )


def _normals(solid: Solid) -> np.ndarray:
    """Mean normal of the triangles about every corner, weighed by their size."""
    a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(solid.vertices)
    for k in range(3):
        np.add.at(normals, solid.faces[:, k], across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """Rotations as rerun counts them: x, y, z, w."""
    return se3.matrix_to_quaternion(rotation)[..., [1, 2, 3, 0]]


def _log_mesh(canvas: Canvas, path: str, old: Mesh | None, new: Mesh) -> None:
    changed, ink = differences(old, new) if old else {"solid"}, (*new.colour, round(255 * new.opacity))
    if old is not None and is_same(old.solid.vertices, new.solid.vertices):
        changed.discard("solid")
    if changed & {"solid", "pose"}:
        solid = new.solid if new.pose is None else new.solid.moved(new.pose)
        canvas.log(path, mesh(solid, ink, flat=new.flat))
    elif "colour" in changed:
        canvas.log(path, rr.Mesh3D.from_fields(albedo_factor=ink))


def _log_arm(canvas: Canvas, path: str, old: Arm | None, new: Arm) -> None:
    """Each body moves with its own frame.

    Other bodies are drawn over the older ones, and what those had more goes: a `Clear` of the whole arm would
    take its poses of the same step away as well.
    """
    if old is None or differences(old, new) - {"frames"}:
        parts = _parts(path, new)
        for name, one in parts.items():
            canvas.log(name, one)
        for name in () if old is None else _parts(path, old).keys() - parts.keys():
            canvas.clear(name)
    turns = quaternion(new.frames[:, :3, :3])
    for i, frame in enumerate(new.frames):
        if old is None or i >= len(old.frames) or not is_same(old.frames[i], frame):
            turn = rr.Quaternion(xyzw=turns[i])
            canvas.log(f"{path}/body{i}", rr.Transform3D(translation=frame[:3, 3], quaternion=turn))


def _parts(path: str, arm: Arm) -> dict[str, rr.AsComponents]:
    """What moves with every body; at the joints of an arm that is no ghost, their numbers."""
    ghost = None if arm.ghost is None else (*arm.ghost, round(255 * arm.opacity))
    parts: dict[str, rr.AsComponents] = {
        f"{path}/body{i}/part{j}": mesh(part.solid, ghost or part.colour)
        for i, body in enumerate(arm.bodies)
        for j, part in enumerate(body.parts)
    }
    joints = range(1, len(arm.bodies)) if arm.ghost is None else ()
    return parts | {f"{path}/body{i}/number": _words(f"J{i}", np.zeros(3)) for i in joints}


def _log_label(canvas: Canvas, path: str, old: Label | None, new: Label) -> None:
    """Once it is there, only its place is drawn."""
    if old is not None and old.text == new.text:
        canvas.log(path, rr.Points3D.from_fields(positions=[new.place]))
    else:
        canvas.log(path, _words(new.text, new.place))


def _words(text: str, place: np.ndarray) -> rr.Points3D:
    return rr.Points3D([place], radii=1e-4, colors=LABEL, labels=[text])


def _log_cubes(canvas: Canvas, path: str, old: Cubes | None, new: Cubes) -> None:
    """A box for every cube that is shown and has a number."""
    if old is None or differences(old, new):
        keep = np.flatnonzero(new.shown & new.known)
        half = np.tile(0.5 * FILL * new.region.size / new.region.shape, (len(keep), 1))
        solid = rr.components.FillMode.Solid
        boxes = rr.Boxes3D(
            centers=new.region.centres[keep], half_sizes=half, colors=new.colours[keep], fill_mode=solid
        )
        canvas.log(path, boxes)


def _arrows(arrows: Arrows) -> rr.Arrows3D:
    vectors, radius = arrows.ends - arrows.starts, arrows.thick * THIN
    return rr.Arrows3D(origins=arrows.starts, vectors=vectors, colors=arrows.colour, radii=radius)


def _cuboid(cuboid: Cuboid) -> rr.LineStrips3D:
    edges = cuboid_edges(cuboid.low, cuboid.high, cuboid.cubes)
    return rr.LineStrips3D(edges, colors=cuboid.colour, radii=THIN)


def markdown(text: str) -> rr.TextDocument:
    """Words and tables."""
    return rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)


LOG: dict[type, Callable[[Canvas, str, Any, Any], None]] = {
    Mesh: _log_mesh,
    Arm: _log_arm,
    Label: _log_label,
    Cubes: _log_cubes,
}
WHOLE: dict[type, Callable[[Any], rr.AsComponents]] = {
    Points: lambda points: rr.Points3D(points.places, colors=points.colours, radii=points.radius),
    Arrows: _arrows,
    Cuboid: _cuboid,
}
"""Drawn anew where anything of them has changed."""
