"""Where the labels of blocks stand on a drawing: clear of what is drawn there, each with a line to its own.

Blocks may nearly touch, and a label is longer than a block is wide."""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from workbench.extras.workshop.drawing import TEXT, View
from workbench.extras.workshop.fixture import overlap

LABEL_DIRECTIONS = 24
"""Directions that are tried about a block."""
GAPS = (1.2, 2.5, 4.0, 6.0, 9.0, 13.0, 18.0, 25.0, 35.0)
"""Distances of a label from its block that are tried [mm of paper]."""
HEIGHT, WIDE = 1.2 * TEXT, 0.7
"""Of letters [mm of paper], and their width as a share of it."""
ROOM = 0.5
"""Of paper about a label [mm]."""
Polygon = Float[np.ndarray, "corners 2"]
Place = tuple[Float[np.ndarray, "2"], Polygon]
"""The middle of a label, and its line to the edge of its block."""


def label_blocks(view: View, labels: Sequence[str], feet: Sequence[Polygon]) -> None:
    """Writes each label near its foot [mm]: the nearest place that covers nothing, nor does its line."""
    drawn = [foot + view.origin for foot in feet]
    taken, scale = [*_drawn(view), *drawn], view.sheet.scale
    for label, foot in zip(labels, drawn, strict=True):
        box = scale * (0.5 * np.array([WIDE * HEIGHT * len(label), HEIGHT]) + ROOM) * CORNERS
        others = [shape for shape in taken if shape is not foot]
        tried = [_place(foot, box, scale * gap, angle) for gap in GAPS for angle in ANGLES]
        covered = partial(_covered, box=box, taken=taken, others=others)
        middle, line = next((place for place in tried if not covered(place)), None) or min(tried, key=covered)
        taken += [middle + box, line]
        view.sheet.text(label, middle, height=HEIGHT, align="middle_center")
        view.sheet.space.add_line(line[0], line[1], dxfattribs={"layer": "TEXT"})


CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
ANGLES = np.pi / 4 + np.linspace(0.0, 2.0 * np.pi, LABEL_DIRECTIONS, endpoint=False)


def _place(foot: Polygon, box: Polygon, gap: float, angle: float) -> Place:
    """So far from a foot in a direction."""
    way, centre = np.array([np.cos(angle), np.sin(angle)]), foot.mean(axis=0)
    reach, own = _to_edge(foot - centre, way), _to_edge(box, way)
    return centre + (reach + gap + own) * way, centre + np.outer([reach, reach + gap], way)


def _to_edge(shape: Polygon, way: Float[np.ndarray, "2"]) -> float:
    """How far a convex polygon's edge is from the origin within it."""
    along = np.roll(shape, -1, axis=0) - shape
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    out = normals @ way
    return float(((normals * shape).sum(axis=1)[out > 0.0] / out[out > 0.0]).min())


def _drawn(view: View) -> list[Polygon]:
    """What a sheet holds so far, outlines edge by edge, all else as boxes."""
    from ezdxf import bbox
    from ezdxf.entities import LWPolyline

    shapes = []
    for entity in view.sheet.space:
        if isinstance(entity, LWPolyline):
            points = np.array(entity.get_points("xy"))
            closed = [*points, points[0]] if entity.closed else points
            shapes += [np.array(edge) for edge in pairwise(closed)]
        else:
            box = bbox.extents([entity], fast=True)
            low, high = np.array(box.extmin)[:2], np.array(box.extmax)[:2]
            shapes.append(0.5 * (low + high) + 0.5 * (high - low) * CORNERS)
    return shapes


def _covered(place: Place, box: Polygon, taken: Sequence[Polygon], others: Sequence[Polygon]) -> int:
    """How many shapes a label at a place covers, and its line."""
    middle, line = place
    return sum(overlap(middle + box, o) for o in _near(middle + box, taken)) + sum(
        overlap(line, o) for o in _near(line, others)
    )


def _near(shape: Polygon, others: Sequence[Polygon]) -> Iterator[Polygon]:
    """Those whose boxes meet that of a shape."""
    low, high = shape.min(axis=0), shape.max(axis=0)
    return (o for o in others if (o.max(axis=0) > low).all() and (o.min(axis=0) < high).all())
