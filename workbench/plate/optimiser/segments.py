"""Distances of line segments from each other and from convex bodies of six faces, compiled for many rows.

Where a segment is outside a convex polyhedron, the minimum distance lies between the segment and an edge, or
between one end of it and a face.

Source: Ericson, Real-Time Collision Detection (2005), §5.1.9 (closest points of two segments), §5.3.8 (a
segment against a polyhedron).
"""

from typing import no_type_check

import numpy as np
from jaxtyping import Float
from numba import njit

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], *([i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4))])
"""Corners of the six faces of a hull, anticlockwise from outside."""
EDGES = np.array(
    [
        [first + i, second]
        for i in range(4)
        for first, second in ((0, (i + 1) % 4), (4, 4 + (i + 1) % 4), (0, 4 + i))
    ]
)
"""Corners at the ends of the twelve edges of a hull."""


def segment_distances(
    first: Float[np.ndarray, "rows pairs 2 3"], second: Float[np.ndarray, "rows pairs 2 3"]
) -> Float[np.ndarray, "rows pairs"]:
    """Minimum distance of two segments, given by their ends [m]."""
    result = np.empty(first.shape[:2])
    _segments(np.ascontiguousarray(first), np.ascontiguousarray(second), result)
    return result


def hull_distances(
    lines: Float[np.ndarray, "rows lines 2 3"],
    corners: Float[np.ndarray, "hulls 8 3"],
    far: Float[np.ndarray, " lines"],
) -> Float[np.ndarray, "rows lines"]:
    """Distance of each segment from a convex body [m]; −inf where it enters it.

    Args:
        lines: Ends of the segments.
        corners: Four of the body's foot and four of its top, anticlockwise from above; one body for all rows,
            or one for each.
        far: Larger distances than this may be given as a lower bound that is not below it [m].
    """
    result = np.empty(lines.shape[:2])
    _hulls(np.ascontiguousarray(lines), np.ascontiguousarray(corners), far, FACES, EDGES, result)
    return result


@njit(cache=True)
@no_type_check
def _segments(first, second, result):
    for row in range(result.shape[0]):
        for pair in range(result.shape[1]):
            one, other = first[row, pair], second[row, pair]
            result[row, pair] = _between(one[0], one[1], other[0], other[1])


@njit(cache=True)
@no_type_check
def _between(start, end, begin, stop):
    """Distance of two segments."""
    a = e = f = b = c = 0.0
    for i in range(3):
        d1 = end[i] - start[i]
        d2 = stop[i] - begin[i]
        r = start[i] - begin[i]
        a += d1 * d1
        e += d2 * d2
        f += d2 * r
        b += d1 * d2
        c += d1 * r
    denominator = a * e - b * b
    s = 0.0
    if denominator > 1e-12 * a * e:
        s = min(max((b * f - c * e) / denominator, 0.0), 1.0)
    t = (b * s + f) / e if e > 0.0 else 0.0
    if t < 0.0 or e <= 0.0:
        t = 0.0
        s = min(max(-c / a, 0.0), 1.0) if a > 0.0 else 0.0
    elif t > 1.0:
        t = 1.0
        s = min(max((b - c) / a, 0.0), 1.0) if a > 0.0 else 0.0
    square = 0.0
    for i in range(3):
        p = start[i] + s * (end[i] - start[i]) - begin[i] - t * (stop[i] - begin[i])
        square += p * p
    return np.sqrt(square)


@njit(cache=True)
@no_type_check
def _hulls(lines, corners, far, faces, edges, result):
    normals, centre = np.empty((6, 3)), np.empty(3)
    size = 0.0
    for row in range(result.shape[0]):
        if row == 0 or len(corners) > 1:
            hull = corners[row if len(corners) > 1 else 0]
            size = _describe(hull, faces, centre, normals)
        for k in range(result.shape[1]):
            start, end = lines[row, k, 0], lines[row, k, 1]
            ball = _between(start, end, centre, centre) - size
            result[row, k] = ball if ball >= far[k] else _from_hull(start, end, hull, normals, faces, edges)


@njit(cache=True)
@no_type_check
def _describe(hull, faces, centre, normals):
    """Centre and normals of a hull; returns the radius of the sphere about it."""
    for i in range(3):
        centre[i] = 0.0
        for corner in range(8):
            centre[i] += hull[corner, i] / 8.0
    size = 0.0
    for corner in range(8):
        square = 0.0
        for i in range(3):
            square += (hull[corner, i] - centre[i]) ** 2
        size = max(size, np.sqrt(square))
    for face in range(6):
        p, q, r, s = hull[faces[face, 0]], hull[faces[face, 1]], hull[faces[face, 2]], hull[faces[face, 3]]
        length = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            normals[face, i] = (r[j] - p[j]) * (s[k] - q[k]) - (r[k] - p[k]) * (s[j] - q[j])
            length += normals[face, i] ** 2
        for i in range(3):
            normals[face, i] /= np.sqrt(length)
    return size


@njit(cache=True)
@no_type_check
def _from_hull(start, end, hull, normals, faces, edges):
    enters, leaves = 0.0, 1.0
    best = np.inf
    for face in range(6):
        normal, corner = normals[face], hull[faces[face, 0]]
        first = last = 0.0
        for i in range(3):
            first += normal[i] * (start[i] - corner[i])
            last += normal[i] * (end[i] - corner[i])
        if first > 0.0 and last > 0.0:
            enters = np.inf
        elif first > 0.0:
            enters = max(enters, first / (first - last))
        elif last > 0.0:
            leaves = min(leaves, first / (first - last))
        if first > 0.0 and _above(start, hull, normal, faces[face]):
            best = min(best, first)
        if last > 0.0 and _above(end, hull, normal, faces[face]):
            best = min(best, last)
    if enters <= leaves:
        return -np.inf
    for edge in range(12):
        best = min(best, _between(start, end, hull[edges[edge, 0]], hull[edges[edge, 1]]))
    return best


@njit(cache=True)
@no_type_check
def _above(point, hull, normal, face):
    """Whether a point's foot on the plane of a face lies within the face."""
    for corner in range(4):
        p, q = hull[face[corner]], hull[face[(corner + 1) % 4]]
        side = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            side += normal[i] * ((q[j] - p[j]) * (point[k] - p[k]) - (q[k] - p[k]) * (point[j] - p[j]))
        if side < 0.0:
            return False
    return True
