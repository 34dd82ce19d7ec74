"""A cube or dodecahedron with a tag on every face: a target that a camera sees from all sides.

The faces are unfolded along a tree of shared edges; a tag has one place in its face, which gives its corners
in the net to print and on the solid alike.
"""

from enum import StrEnum
from itertools import product

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from workbench.base.errors import OptionError
from workbench.base.types import frozen
from workbench.data.camera.camera import Mount
from workbench.data.camera.markers import black_cells, count
from workbench.data.camera.printed import Sheet, marker_polygons
from workbench.data.camera.target import Target

MM = 1e3
TAG = {"cube": 0.75, "dodecahedron": 0.85}
"""Side of a tag, as a part of the edge, where none is given."""
SQUARE = frozen(np.array([[-1, 1], [1, 1], [1, -1], [-1, -1]], float))
PLANE = np.array([1.0, 1.0j])
"""Points of a plane as complex numbers, whose products turn."""
QUIET = 1.1
"""White around a tag, as a part of its size: its corners must still lie on the face."""


class Shape(StrEnum):
    """A solid with a tag on every face."""

    CUBE = "cube"
    DODECAHEDRON = "dodecahedron"


def tag_solid(
    shape: Shape | str,
    edge: float,
    *,
    tag: float | None = None,
    dictionary: str,
    mounted: Mount | str,
    number: int = 1,
    name: str = "",
) -> tuple[Target, Sheet]:
    """The corners of all tags in the solid's frame, from its middle, and the net to print.

    Args:
        shape: Cube or dodecahedron.
        edge: Length of its edges [m].
        tag: Side of the tags [m]; what suits the face if None.
        dictionary: Of the tags; face k of the first solid has number k, others go on from there.
        mounted: What carries the solid.
        number: Of this solid among several, from 1.
        name: Of this one.

    Raises:
        OptionError: tags that don't fit on the faces, or an unknown dictionary.
    """
    shape = Shape(shape)
    tag = TAG[shape] * edge if tag is None else tag
    faces = _faces(shape, edge)
    if edge <= 0.0 or tag <= 0.0 or not _fits(faces[0], QUIET * tag):
        most = edge if shape is Shape.CUBE else edge * 1.0605
        raise OptionError(
            f"tags of {MM * tag:g} mm don't fit on a {shape} with edges of {MM * edge:g} mm; use at most "
            f"{MM * most / QUIET:.1f} mm"
        )
    first = (number - 1) * len(faces)
    if count(dictionary) < first + len(faces):
        which = f"{shape} {number} needs tags {first} … {first + len(faces) - 1}"
        raise OptionError(f"{which}, {dictionary} has {count(dictionary)}")
    flat = _unfolded(faces)
    corners = 0.5 * tag * SQUARE
    on_solid = np.stack([_frame(face)[:3, 3] + corners @ _frame(face)[:3, :2].T for face in faces])
    names = first + np.repeat(np.arange(len(faces)), 4)
    target = Target(
        name=name,
        mounted=Mount(mounted),
        ids=names,
        corners=np.tile(np.arange(4), len(faces)),
        points=frozen(on_solid.reshape(-1, 3)),
        dictionary=dictionary,
    )
    return target, _net(shape, flat, corners, edge, tag, dictionary, first)


def _faces(shape: Shape, edge: float) -> list[Float[np.ndarray, "corners 3"]]:
    """Corners of every face, counter-clockwise from outside [m]."""
    if shape is Shape.CUBE:
        points = 0.5 * edge * np.array(list(product((-1, 1), repeat=3)), float)
    else:
        golden = 0.5 * (1.0 + np.sqrt(5.0))
        points = np.array(list(product((-1, 1), repeat=3)), float)
        for k in range(3):
            pairs = product((-1 / golden, 1 / golden), (-golden, golden))
            points = np.concatenate([points, [np.roll([0.0, a, b], k) for a, b in pairs]])
        points *= 0.5 * edge * golden
    hull = ConvexHull(points)
    planes = np.unique(np.round(hull.equations, 9), axis=0)
    planes = planes[np.lexsort((planes[:, 0], planes[:, 1], -np.round(planes[:, 2], 6)))]
    return [_around(points[np.abs(points @ n[:3] + n[3]) < 1e-6 * edge], n[:3]) for n in planes]


def _around(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Corners in order about the outward normal."""
    centre = points.mean(0)
    first = points[0] - centre
    angle = np.arctan2(np.cross(first, points - centre) @ normal, (points - centre) @ first)
    return points[np.argsort(angle)]


def _frame(face: Float[np.ndarray, "corners d"]) -> Float[np.ndarray, "e e"]:
    """Pose of a face: its middle, x along its first edge, y to the inside of that edge, z outwards."""
    d = face.shape[1]
    pose = np.eye(d + 1)
    along = face[1] - face[0]
    along = along / np.linalg.norm(along)
    middle = face.mean(0)
    inwards = middle - face[0]
    inwards = inwards - (inwards @ along) * along
    pose[:d, 0], pose[:d, 1], pose[:d, d] = along, inwards / np.linalg.norm(inwards), middle
    if d == 3:
        pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
    return pose


def _fits(face: np.ndarray, side: float) -> bool:
    """Whether a square of this side, along the first edge, lies on the face."""
    pose = _frame(face)
    flat = (face - pose[:3, 3]) @ pose[:3, :2]
    square = 0.5 * side * SQUARE
    edges = np.roll(flat, -1, axis=0) - flat
    away = square[:, None] - flat
    return bool((edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] > -1e-12).all())


def _unfolded(faces: list[np.ndarray]) -> list[Float[np.ndarray, "corners 2"]]:
    """The faces in one plane, seen from outside: each beside a neighbour that lies there already."""
    pose = _frame(faces[0])
    flat: dict[int, np.ndarray] = {0: (faces[0] - pose[:3, 3]) @ pose[:3, :2]}
    todo = [0]
    while todo:
        done = todo.pop(0)
        for k, face in enumerate(faces):
            if k in flat or (pair := _shared(faces[done], face)) is None:
                continue
            own, other = pair
            pose = _frame(face)
            local = (face - pose[:3, 3]) @ pose[:3, :2]
            (a, c), (b, d) = local[other] @ PLANE, flat[done][own] @ PLANE
            placed = (local @ PLANE - a) * (d - b) / (c - a) + b
            flat[k] = np.stack([placed.real, placed.imag], axis=1)
            todo.append(k)
    return [flat[k] for k in range(len(faces))]


def _shared(one: np.ndarray, two: np.ndarray) -> tuple[list[int], list[int]] | None:
    """Corners of the edge that two faces share, in the order of the first."""
    near = np.linalg.norm(one[:, None] - two, axis=2) < 1e-9 + 1e-6 * np.ptp(one)
    pairs = np.argwhere(near)
    return None if len(pairs) != 2 else (pairs[:, 0].tolist(), pairs[:, 1].tolist())


def _net(
    shape: Shape,
    flat: list[np.ndarray],
    corners: np.ndarray,
    edge: float,
    tag: float,
    dictionary: str,
    first: int,
) -> Sheet:
    """The net with its tags, y down [mm]."""
    everything = np.concatenate(flat)
    low, high = everything.min(0), everything.max(0)

    def page(points: np.ndarray) -> np.ndarray:
        return MM * np.stack([points[..., 0] - low[0], high[1] - points[..., 1]], axis=-1)

    black, labels, edges = [], [], []
    for k, face in enumerate(flat, first):
        pose = _frame(face)
        square = page(pose[:2, 2] + corners @ pose[:2, :2].T)
        black += marker_polygons(black_cells(dictionary, k), square)
        foot = page(pose[:2, 2] - pose[:2, 1] * 0.5 * (0.5 * tag + _inner(face)))
        labels.append(((float(foot[0]), float(foot[1])), str(k)))
        ring = page(face)
        edges += [np.stack([ring[i], ring[(i + 1) % len(ring)]]) for i in range(len(ring))]
    middles = np.array([e.mean(0) for e in edges])
    same = np.abs(middles[:, None] - middles).max(2) < 1e-3
    folds = [e for k, e in enumerate(edges) if same[k, :k].any()]
    cuts = [e for k, e in enumerate(edges) if same[k].sum() == 1]
    size = MM * (high - low)
    title = f"{shape}, edges {MM * edge:g} mm, tags {MM * tag:g} mm, {dictionary}: cut, fold, glue"
    return Sheet((float(size[0]), float(size[1])), black, folds=folds, cuts=cuts, labels=labels, title=title)


def _inner(face: np.ndarray) -> float:
    """Distance of a face's middle from its edges."""
    pose = _frame(face)
    return float(abs((face[0] - pose[:2, 2]) @ pose[:2, 1]))
