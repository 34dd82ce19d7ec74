"""What a click on the scene means.

Nothing drawn answers to the pointer itself: viser stops it there, and a handle behind could not be grabbed.
So a click is a ray, and what it meets is found here.
"""

from collections.abc import Iterable
from operator import itemgetter
from typing import Any

import numpy as np
from jaxtyping import Float

from workbench.base.types import Vector3
from workbench.views.drawables.drawable import Mesh, Points

POINTER = 0.008
"""Angle about the pointer in which points are clicked [rad]."""
BALL = 0.75
"""Radius of the ball that a block is for a click, as a share of the distance of its corners."""
MAX_BEHIND = 0.02
"""How far behind a target's middle the points at it may lie [m]."""
Ray = tuple[Vector3, Vector3]
"""Where the camera is, and the direction from there through the pointer."""
Hit = tuple[float, int]
"""Distance from the camera [m], and the number of what is there."""


def picked(
    drawn: Iterable[tuple[str, Any]], ray: Ray, *, points_first: bool = False
) -> tuple[str, int] | None:
    """Path and number of what a click means: the nearest, a target rather than the points around it.

    `points_first`: the points at a target instead, as while rows are looked at.
    """
    solid, points = list[tuple[float, int, str]](), list[tuple[float, int, str]]()
    for path, drawable in drawn:
        if isinstance(drawable, Points) and (drawable.numbers >= 0).all():
            if (hit := nearest_to_ray(drawable.places, *ray)) is not None:
                points.append((hit[0], int(drawable.numbers[hit[1]]), path))
        elif isinstance(drawable, Mesh) and drawable.number is not None:
            corners = drawable.solid.vertices
            middle = corners.mean(0)
            size = BALL * float(np.linalg.norm(corners - middle, axis=1).max())
            if (hit := nearest_to_ray(middle[None], *ray, size=size)) is not None:
                solid.append((hit[0], drawable.number, path))
    nearest = min(solid or points, default=None, key=itemgetter(0))
    if solid and nearest is not None and points_first:
        seen = [point for point in points if point[0] < nearest[0] + MAX_BEHIND]
        nearest = min(seen, default=nearest, key=itemgetter(0))
    return None if nearest is None else (nearest[2], nearest[1])


def nearest_to_ray(
    places: Float[np.ndarray, "points 3"], origin: Vector3, direction: Vector3, *, size: float = 0.0
) -> Hit | None:
    """The place that a click means, the nearest to the camera [m] of those under a ray of unit length.

    `size` is the radius of what is there [m].
    """
    off = places - origin
    along = off @ direction
    aside = np.maximum(np.linalg.norm(off - along[:, None] * direction, axis=1) - size, 0.0)
    under = np.flatnonzero((along > 0.0) & (aside <= POINTER * along))
    if not len(under):
        return None
    first = int(under[np.argmin(along[under] + aside[under] / POINTER)])
    return float(along[first]), first
