"""What a click on the scene means.

Nothing drawn answers to the pointer itself: viser stops it there, and a handle behind could not be grabbed.
So a click is a ray, and what it meets is found here.
"""

from collections.abc import Callable, Iterable
from operator import itemgetter
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.base.types import Vector3
from workbench.views.appearance.shapes import Solid
from workbench.views.drawables.drawable import Mesh, Points
from workbench.views.page.scene.node import Ray

POINTER = 0.008
"""Angle about the pointer in which points are clicked [rad]."""
MAX_BEHIND = 0.02
"""How far behind a target's face the points at it may lie [m]."""
EDGE = 1e-9
"""How far beyond its edges a triangle is still met, as a share: no ray passes between two of them."""
Hit = tuple[float, int]
"""Distance from the camera [m], and the number of what is there."""


def picked(
    drawn: Iterable[tuple[str, Any]], ray: Ray, *, points_first: bool = False
) -> tuple[str, int] | None:
    """Path and number of what a click means: the nearest, a target rather than the points around it.

    `points_first`: the points at a target instead, as while rows are looked at.
    """
    solid: list[tuple[float, int, str]] = []
    points: list[tuple[float, int, str]] = []
    for path, drawable in drawn:
        if (find := FINDERS.get(type(drawable))) and (hit := find(drawable, *ray)):
            (points if isinstance(drawable, Points) else solid).append((*hit, path))
    nearest = min(solid or points, default=None, key=itemgetter(0))
    if solid and nearest is not None and points_first:
        seen = [point for point in points if point[0] < nearest[0] + MAX_BEHIND]
        nearest = min(seen, default=nearest, key=itemgetter(0))
    return None if nearest is None else (nearest[2], nearest[1])


def nearest_to_ray(places: Float[np.ndarray, "points 3"], origin: Vector3, direction: Vector3) -> Hit | None:
    """The place that a click means, the nearest to the camera [m] of those under a ray of unit length."""
    off = places - origin
    along = off @ direction
    aside = np.linalg.norm(off - along[:, None] * direction, axis=1)
    under = np.flatnonzero((along > 0.0) & (aside <= POINTER * along))
    if not len(under):
        return None
    first = int(under[np.argmin(along[under] + aside[under] / POINTER)])
    return float(along[first]), first


def distance_to(solid: Solid, origin: Vector3, direction: Vector3) -> float | None:
    """How far along a ray it first meets a solid [m]; None where it misses.

    A triangle a, a + u, a + v is met where origin + t direction = a + r u + s v with r, s ≥ 0 and r + s ≤ 1.
    """
    first, second, third = (solid.vertices[corner] for corner in solid.faces.T)
    u, v = second - first, third - first
    normal = np.cross(u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = 1.0 / -(normal @ direction)
        turned = np.cross(origin - first, direction)
        r, s = (v * turned).sum(1) * share, -(u * turned).sum(1) * share
        t = ((origin - first) * normal).sum(1) * share
        met = t[(r >= -EDGE) & (s >= -EDGE) & (r + s <= 1.0 + EDGE) & (t > 0.0)]
    return float(met.min()) if len(met) else None


def _mesh(mesh: Mesh, origin: Vector3, direction: Vector3) -> Hit | None:
    if mesh.number is None:
        return None
    solid = mesh.solid if mesh.pose is None else mesh.solid.moved(mesh.pose)
    away = distance_to(solid, origin, direction)
    return None if away is None else (away, mesh.number)


def _points(points: Points, origin: Vector3, direction: Vector3) -> Hit | None:
    if (points.numbers < 0).all():
        return None
    hit = nearest_to_ray(points.places, origin, direction)
    return None if hit is None else (hit[0], int(points.numbers[hit[1]]))


FINDERS: dict[type, Callable[[Any, Vector3, Vector3], Hit | None]] = {Mesh: _mesh, Points: _points}
